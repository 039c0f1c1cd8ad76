// The report: its charts, the switch of colours, and the page that people can touch.

import { unpackText } from "../../core/web/modules/blobs.js";
import { Chart } from "../../core/web/modules/chart.js";
import { byId } from "../../core/web/modules/elements.js";
import { beginTheme } from "../../core/web/modules/theme.js";

/** Gives the page inside the colours of the report, by its own switch. */
function colourInside(frame) {
  const inner = frame?.contentDocument?.getElementById("theme");
  const isDark = (button) => button.getAttribute("aria-pressed");
  if (inner && isDark(inner) !== isDark(byId("theme"))) {
    inner.click();
  }
}

/** Gives the page inside as much height as it needs. */
function showInside(frame) {
  const fit = () => {
    frame.style.height = `${frame.contentDocument.body.scrollHeight + 4}px`;
  };
  const begin = () => {
    new ResizeObserver(fit).observe(frame.contentDocument.body);
    fit();
    frame.contentDocument.getElementById("theme").hidden = true;
    colourInside(frame);
  };
  frame.addEventListener("load", begin);
  if (frame.contentDocument?.readyState === "complete" && frame.contentDocument.body !== null) {
    begin();
  }
}

/** Opens what is folded: the section that the address names, all by the button, all on paper. */
function beginFolds() {
  const folds = [...document.querySelectorAll(".folded > details")];
  const openAll = () => folds.forEach((fold) => (fold.open = true));
  const openNamed = () => {
    const named = document.getElementById(location.hash.slice(1));
    const fold = named?.querySelector(":scope > details");
    if (fold) {
      fold.open = true;
      named.scrollIntoView();
    }
  };
  document.getElementById("unfold")?.addEventListener("click", openAll);
  window.addEventListener("beforeprint", openAll);
  window.addEventListener("hashchange", openNamed);
  const contents = document.querySelector("nav details");
  if (contents !== null) {
    contents.open = window.matchMedia("(min-width: 1180px)").matches;
  }
  openNamed();
}

async function showCharts() {
  const { columns, charts } = JSON.parse(await unpackText("charts"));
  const shown = charts.map((description) => new Chart(description, columns));
  document.querySelectorAll("[data-chart]").forEach((place) => {
    place.append(shown[Number(place.dataset.chart)].block);
  });
  const drawAll = () => shown.forEach((chart) => chart.draw());
  window.addEventListener("beforeprint", drawAll); // those that were folded until now too
  drawAll();
  return shown;
}

async function beginReport() {
  beginFolds();
  const shown = await showCharts();
  const frame = document.getElementById("inside");
  beginTheme(() => {
    shown.forEach((chart) => chart.draw());
    colourInside(frame);
  });
  if (frame !== null) {
    showInside(frame);
  }
  document.documentElement.dataset.ready = "yes";
}

beginReport().catch((error) => {
  byId("problem").textContent = `The charts cannot be drawn here: ${error.message}`;
  byId("problem").hidden = false;
  document.documentElement.dataset.ready = "no";
});
