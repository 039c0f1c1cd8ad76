// The page: it unpacks what it carries, and shows the surrogate live, or over a record.

import { App } from "./app.js";
import { unpackBlob, unpackText } from "../../../core/web/modules/blobs.js";
import { byId } from "../../../core/web/modules/elements.js";
import { loadRuntime, Machine } from "./machine.js";
import { waitForFmu } from "./welcome.js";

function showSurrogate(runtime, { facts, surrogate, files, drawing }) {
  new App(facts, new Machine(runtime, surrogate), files, drawing).begin();
}

async function begin() {
  const facts = JSON.parse(byId("facts").textContent);
  const runtime = await loadRuntime(await unpackBlob("runtime"));
  if (facts === null) {
    waitForFmu((found) => showSurrogate(runtime, found));
    document.documentElement.dataset.ready = "wait";
    return;
  }
  const files = {};
  for (const name of facts.trajectory === null ? [] : ["inputs", "results", "reference"]) {
    files[name] = await unpackText(name);
  }
  const drawing = facts.drawn ? JSON.parse(await unpackText("drawing")) : null;
  showSurrogate(runtime, { facts, surrogate: await unpackBlob("surrogate"), files, drawing });
  document.documentElement.dataset.ready = "yes";
}

begin().catch((error) => {
  byId("problem").textContent = `The page cannot run here: ${error.message}`;
  byId("problem").hidden = false;
  document.documentElement.dataset.ready = "no";
});
