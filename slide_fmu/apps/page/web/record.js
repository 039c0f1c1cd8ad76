// A whole record of inputs through the surrogate.

/**
 * Runs a session from a fresh start over a record: an answer for every time.
 *
 * time, inputs (columns): row k is set before the step from time[k] to time[k + 1], the first one
 * also before the start.
 */
export function runRecord(session, time, inputs, parameters, confidence) {
  const row = (k) => inputs.map((column) => column[k]);
  const answers = [session.restart(row(0), parameters, confidence)];
  for (let k = 0; k + 1 < time.length; k += 1) {
    answers.push(session.step(row(k), time[k + 1] - time[k]));
  }
  return answers;
}

/** Columns of a run, by the names that the FMU gives to its variables. */
export function columnsOf(facts, answers) {
  const found = new Map();
  const add = (name, pick) => found.set(name, Float64Array.from(answers, pick));
  facts.outputs.forEach((output, i) => {
    add(output.name, (answer) => answer.outputs[i]);
    if (output.estimate !== null) {
      add(`${output.name}_error_estimate`, (answer) => answer.estimates[i]);
    }
    if (output.bound !== null) {
      add(`${output.name}_error_bound`, (answer) => answer.bounds[i]);
    }
  });
  for (const name of Object.keys(facts.flags)) {
    add(name, (answer) => answer.flags[name]);
  }
  return found;
}

/** A reference beside an output: its values at the last times of the run, NaN where there is none. */
export function beside(reference, count) {
  const values = new Float64Array(count).fill(NaN);
  values.set(reference, count - reference.length);
  return values;
}

/** Root mean square of the error where the reference is known, over that of the reference about its mean. */
export function relativeError(values, reference) {
  const known = Array.from(reference, (_, k) => k).filter((k) => Number.isFinite(reference[k]));
  const mean = known.reduce((sum, k) => sum + reference[k], 0) / known.length;
  let [error, scale] = [0, 0];
  for (const k of known) {
    error += (values[k] - reference[k]) ** 2;
    scale += (reference[k] - mean) ** 2;
  }
  return Math.sqrt(error / scale);
}
