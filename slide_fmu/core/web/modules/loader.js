// Runs the script that a page holds compressed, and says where it cannot.

import { unpackText } from "./blobs.js";
import { byId, element } from "./elements.js";

const PATIENCE = 20000; // ms, after which a page counts as loaded in any case

/** Keeps the page loading until it is ready, so that pictures and prints of it wait for that. */
function holdLoading() {
  const frame = element("iframe", { hidden: true });
  document.body.append(frame);
  frame.contentDocument.open(); // a page is still loading while a document inside is written
  const end = () => {
    frame.contentDocument?.close();
    frame.remove();
  };
  new MutationObserver(end).observe(document.documentElement, { attributeFilter: ["data-ready"] });
  setTimeout(end, PATIENCE);
}

holdLoading();
unpackText("script").then(
  (text) => document.head.append(element("script", { type: "module" }, text)),
  (error) => {
    byId("problem").textContent = `The page cannot run here: ${error.message}`;
    byId("problem").hidden = false;
    document.documentElement.dataset.ready = "no";
  },
);
