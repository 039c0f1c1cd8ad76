// An FMU of slide-fmu as a file: what a page needs of it.

import { readTable } from "./csv.js";
import { factsOfFmu, parametersOf } from "./fmu_facts.js";
import { entriesOf, unzip } from "./zip.js";

const SURROGATE = "resources/surrogate.slide";
const PROVENANCE = "resources/provenance.json";
const RUN = "extra/org.fmi-standard.fmi-ls-ref";

/** Reads { facts, surrogate, files, drawing } from the bytes of an FMU. */
export async function readFmu(bytes, name) {
  try {
    const entries = entriesOf(bytes);
    const whole = (path) => (entries.has(path) ? unzip(bytes, entries.get(path)) : null);
    const text = async (path) => {
      const found = await whole(path);
      return found === null ? null : new TextDecoder().decode(found);
    };
    const surrogate = await whole(SURROGATE);
    const description = await text("modelDescription.xml");
    if (surrogate === null || description === null) {
      throw new Error(`it has no ${surrogate === null ? SURROGATE : "modelDescription.xml"}`);
    }
    const files = {
      inputs: await text(`${RUN}/inputs.csv`),
      results: await text(`${RUN}/results.csv`),
      reference: await text(`${RUN}/reference_model.csv`),
    };
    const stored = Object.values(files).every((file) => file !== null);
    const results = stored ? readTable(files.results, "results.csv") : null;
    const given = await text(`${RUN}/parameters.ssv`);
    const facts = factsOfFmu(description, results);
    const trajectory = stored ? { parameters: given === null ? {} : parametersOf(given) } : null;
    const drawing = JSON.parse((await text(PROVENANCE)) ?? "{}").drawing ?? null;
    const drawn = drawing !== null;
    return {
      facts: { ...facts, title: facts.name, trajectory, drawn, moves: null, usual: null },
      ...{ surrogate, files, drawing },
    };
  } catch (error) {
    throw new Error(`${name}: ${error.message}; expected an FMU made by slide-fmu`);
  }
}
