// Runs the runtime as WebAssembly on a task, a JSON file, and prints what came of it as JSON.
//
// task: { runtime, surrogate: paths, facts, time, inputs: columns, parameters, confidence, rounds,
// timed: value references by name }. The result has columns by name, and the seconds of a step
// that reads the variables of each name in timed: the least of all rounds, since other programs
// may be at work.

import { readFileSync } from "node:fs";
import { loadRuntime, Machine } from "../../../slide_fmu/apps/page/web/machine.js";
import { columnsOf, runRecord } from "../../../slide_fmu/apps/page/web/record.js";
import { Session } from "../../../slide_fmu/apps/page/web/session.js";

const task = JSON.parse(readFileSync(process.argv[2], "utf-8"));
const runtime = await loadRuntime(readFileSync(task.runtime));
const machine = new Machine(runtime, readFileSync(task.surrogate));
const session = new Session(machine, task.facts);
const answers = runRecord(session, task.time, task.inputs, task.parameters, task.confidence);
const columns = Object.fromEntries(
  [...columnsOf(task.facts, answers)].map(([name, values]) => [name, Array.from(values)]),
);
const seconds = {};
for (const [name, references] of Object.entries(task.timed ?? {})) {
  seconds[name] = timeOf(machine.port(references));
}
console.log(JSON.stringify({ columns, seconds }));

/** The seconds of a step that sets the inputs and reads a port. */
function timeOf(port) {
  const rows = task.time.map((_, k) => task.inputs.map((column) => column[k]));
  const found = [];
  for (let round = 0; round < task.rounds; round += 1) {
    session.restart(rows[0], task.parameters, task.confidence);
    const begin = performance.now();
    for (let k = 0; k + 1 < rows.length; k += 1) {
      session.given.set(rows[k]);
      machine.step(task.time[k + 1] - task.time[k]);
      port.get();
    }
    found.push((performance.now() - begin) / 1000 / (rows.length - 1));
  }
  return Math.min(...found);
}
