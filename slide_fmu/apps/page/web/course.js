// A record: its inputs, what the surrogate answers, and what a reference gave.

import { pickColumns, readTable, writeTable } from "./csv.js";
import { beside, columnsOf, relativeError, runRecord } from "./record.js";
import { digits } from "../../../core/web/modules/units.js";

/** A Course is a record that the surrogate has answered. */
export class Course {
  /**
   * time, inputs (columns); references: a column for every output, or null; parameters: by name,
   * those that the record belongs to, or null: those that are set.
   */
  constructor({ name, time, inputs, references, parameters }) {
    Object.assign(this, { name, time, inputs, references, parameters });
    this.rows = Array.from(time, (_, k) => inputs.map((column) => column[k]));
  }

  /** Runs the surrogate over it. */
  run(session, facts, parameters, confidence) {
    this.given = parameters;
    this.answers = runRecord(session, this.time, this.inputs, parameters, confidence);
    this.columns = columnsOf(facts, this.answers);
  }

  get xRange() {
    return [this.time[0], this.time.at(-1)];
  }

  /** Rows of a table: every output, and how far it is from its reference. */
  errors(facts) {
    return facts.outputs.flatMap((output, i) => {
      const reference = this.references[i];
      if (reference === null) {
        return [];
      }
      const error = relativeError(this.columns.get(output.name), reference);
      return [[output.name, `${digits(100 * error)} %`]];
    });
  }

  /** As CSV: inputs and all answers. */
  table(facts) {
    const names = facts.inputs.map((input) => input.name);
    const all = [...this.inputs, ...this.columns.values()];
    return writeTable([...names, ...this.columns.keys()], this.time, all);
  }
}

/** The stored trajectory of the FMU, from its three files. */
export function storedCourse(facts, files) {
  const inputs = readTable(files.inputs, "inputs.csv");
  const reference = readTable(files.reference, "reference_model.csv");
  const count = inputs.time.length;
  return new Course({
    name: "stored trajectory",
    time: inputs.time,
    inputs: pickColumns(inputs, facts.inputs.map((input) => input.name), "inputs.csv"),
    references: facts.outputs.map(({ name }) => {
      const index = reference.names.indexOf(name);
      return index < 0 ? null : beside(reference.columns[index], count);
    }),
    parameters: facts.trajectory.parameters,
  });
}

/** A user's own record; columns with names of outputs are references. */
export function ownCourse(facts, text, name) {
  const table = readTable(text, name);
  const begin = table.time[0];
  return new Course({
    name,
    time: table.time.map((t) => t - begin),
    inputs: pickColumns(table, facts.inputs.map((input) => input.name), name),
    references: facts.outputs.map((output) => {
      const index = table.names.indexOf(output.name);
      return index < 0 ? null : table.columns[index];
    }),
    parameters: null,
  });
}

/** The largest difference of a run to the results that the FMU stores, over the outputs' ranges. */
export function differenceTo(results, course, facts) {
  const table = readTable(results, "results.csv");
  let largest = 0;
  for (const { name, low, high } of facts.outputs) {
    const [stored] = pickColumns(table, [name], "results.csv");
    course.columns.get(name).forEach((value, k) => {
      largest = Math.max(largest, Math.abs(value - stored[k]) / (high - low));
    });
  }
  return largest;
}
