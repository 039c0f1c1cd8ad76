// A page without a surrogate asks for an FMU, which stays on the device.

import { byId, write } from "../../../core/web/modules/elements.js";
import { beginTheme } from "../../../core/web/modules/theme.js";
import { readFmu } from "./fmu_file.js";

/** Waits for an FMU that can be shown: show({ facts, surrogate, files, drawing }) may refuse it. */
export function waitForFmu(show) {
  const welcome = byId("welcome");
  const take = async (file) => {
    if (file === undefined) {
      return;
    }
    const problem = byId("problem");
    problem.hidden = true;
    try {
      const found = await readFmu(new Uint8Array(await file.arrayBuffer()), file.name);
      describe(found.facts);
      show(found);
      welcome.hidden = true;
      document.documentElement.dataset.ready = "yes";
    } catch (error) {
      problem.textContent = error.message;
      problem.hidden = false;
    }
  };
  welcome.hidden = false;
  beginTheme(() => {}); // nothing is drawn yet
  byId("fmu").addEventListener("change", () => take(byId("fmu").files[0]));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    if (event.defaultPrevented) {
      return; // a record for the surrogate that is shown
    }
    event.preventDefault();
    if (!welcome.hidden) {
      take(event.dataTransfer.files[0]);
    } else {
      write(byId("summary"), "Reload this page to open another FMU.");
    }
  });
}

/** Writes what a page of one FMU says of it. */
function describe({ name, inputs, outputs, step, memory }) {
  const counted = (list, what) => `${list.length} ${what}${list.length > 1 ? "s" : ""}`;
  const short = (value, digits) => Number(value.toPrecision(digits));
  document.title = name;
  write(byId("title"), name);
  write(
    byId("summary"),
    `surrogate ${name}: ${counted(inputs, "input")}, ${counted(outputs, "output")}, ` +
      `a step of ${short(step, 4)} s. Outputs depend on the inputs of the last ${short(memory, 3)} s.`,
  );
  write(byId("columns"), inputs.map((input) => input.name).join(", "));
  byId("fmu-name").textContent = name;
}
