// The page: it unpacks what it carries, and shows the surrogate live, or over a record.

import { App } from "./app.js";
import { unpackBlob, unpackText } from "../../../core/web/modules/blobs.js";
import { byId } from "../../../core/web/modules/elements.js";
import { loadRuntime, Machine } from "./machine.js";

async function begin() {
  const facts = JSON.parse(byId("facts").textContent);
  const [runtime, surrogate] = await Promise.all([unpackBlob("runtime"), unpackBlob("surrogate")]);
  const files = {};
  for (const name of facts.trajectory === null ? [] : ["inputs", "results", "reference"]) {
    files[name] = await unpackText(name);
  }
  const drawing = facts.drawn ? JSON.parse(await unpackText("drawing")) : null;
  const machine = new Machine(await loadRuntime(runtime), surrogate);
  new App(facts, machine, files, drawing).begin();
  document.documentElement.dataset.ready = "yes";
}

begin().catch((error) => {
  byId("problem").textContent = `The page cannot run here: ${error.message}`;
  byId("problem").hidden = false;
  document.documentElement.dataset.ready = "no";
});
