// What is set stands in the address of the page, so that a copied link shows the same.

import { byId } from "../../../core/web/modules/elements.js";

// browsers refuse addresses that change too often
const WAIT = 500;

const numbersIn = (text) => (text === null ? [] : text.split(",").map(Number));
const textOf = (values) => values.map((value) => Number(value.toPrecision(6))).join(",");

/** What is set in an app, as the fragment of an address. */
export function stateOf(app) {
  const { live, way, player, grip } = app;
  const found = { way };
  if (live.wandering) {
    found.wander = 1;
  } else {
    found.inputs = textOf(live.targets);
  }
  if (live.pace !== 1) {
    found.pace = live.pace;
  }
  if (app.parameters.length > 0) {
    found.parameters = textOf(app.parameters);
  }
  if (app.facts.confidence !== null) {
    found.confidence = textOf([app.confidence]);
  }
  if (way === "stored" && !app.playing) {
    found.time = textOf([player.time]);
  }
  if (grip !== null) {
    found.deflection = byId("magnify").value;
    found.trail = Number(byId("trail").checked);
  }
  const { theme } = document.documentElement.dataset;
  if (theme !== undefined) {
    found.theme = theme;
  }
  const parts = Object.entries(found).filter(([, value]) => value !== "");
  return parts.map(([name, value]) => `${name}=${value}`).join("&");
}

/** Sets a control of the page as if people did. */
function choose(id, change) {
  const control = byId(id);
  change(control);
  control.dispatchEvent(new Event("change"));
}

/** Values of an address that fit the signals they are for, within their ranges. */
function fitting(values, signals) {
  if (values.length !== signals.length || !values.every(Number.isFinite)) {
    return null;
  }
  return values.map((value, i) => Math.min(Math.max(value, signals[i].low), signals[i].high));
}

/** Sets what an address says, before an app begins; what does not fit is left as it was. */
export function takeState(app, fragment) {
  const given = new URLSearchParams(fragment.replace(/^#/, ""));
  const { facts, live } = app;
  const inputs = fitting(numbersIn(given.get("inputs")), app.channels);
  if (inputs !== null) {
    live.targets = inputs;
  }
  if (given.has("wander") || inputs !== null) {
    app.wander(inputs === null && given.get("wander") === "1");
  }
  const parameters = fitting(numbersIn(given.get("parameters")), facts.parameters);
  app.parameters = parameters ?? app.parameters;
  if (facts.confidence !== null) {
    const [confidence] = fitting(numbersIn(given.get("confidence")), [facts.confidence]) ?? [];
    app.confidence = confidence ?? app.confidence;
  }
  if (["dark", "light"].includes(given.get("theme"))) {
    document.documentElement.dataset.theme = given.get("theme");
  }
  const isChoice = (id, value) => [...byId(id).options].some((option) => option.value === value);
  for (const [id, name] of [["pace", "pace"], ["magnify", "deflection"]]) {
    if (given.has(name) && isChoice(id, given.get(name))) {
      choose(id, (control) => {
        control.value = given.get(name);
      });
    }
  }
  if (app.grip !== null && given.has("trail")) {
    choose("trail", (control) => {
      control.checked = given.get("trail") === "1";
    });
  }
  const [time] = given.has("time") ? numbersIn(given.get("time")) : [NaN];
  return { way: given.get("way") ?? (given.has("stored") ? "stored" : "live"), time };
}

/** Keeps what is set in the address; pages in frames have none of their own. */
export class Address {
  constructor(app) {
    this.app = app;
    this.wroteAt = 0;
    this.own = window.parent === window;
  }

  write(now) {
    if (!this.own || this.app.way === "own" || now - this.wroteAt < WAIT) {
      return;
    }
    const text = `#${stateOf(this.app)}`;
    if (text !== location.hash) {
      this.wroteAt = now;
      history.replaceState(null, "", text);
    }
  }
}
