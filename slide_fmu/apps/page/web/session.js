// A surrogate in time: what is set and read, by the facts that the page holds about it.

/** A run of a machine: every row of inputs gives an answer. */
export class Session {
  constructor(machine, facts) {
    const { inputs, outputs, parameters, confidence, flags, known } = facts;
    this.machine = machine;
    this.flags = Object.keys(flags);
    this.given = machine.port(inputs.map((input) => input.reference));
    this.parameters = machine.port(parameters.map((parameter) => parameter.reference));
    this.confidence = confidence === null ? null : machine.port([confidence.reference]);
    this.groups = {
      outputs: outputs.map((output) => output.reference),
      estimates: outputs.map((output) => output.estimate).filter((r) => r !== null),
      bounds: outputs.map((output) => output.bound).filter((r) => r !== null),
      flags: Object.values(flags),
    };
    this.read = machine.port(Object.values(this.groups).flat());
    this.outputs = machine.port(this.groups.outputs);
    this.saysKnown = known === null ? null : machine.port([known]);
    // Is what is set all that inputs do in a step? Moving ones are set to what they reach by its end.
    this.known = false;
  }

  /** Starts anew; the first row of inputs counts as held for ever before. */
  restart(row, parameters, confidence) {
    this.begin(row, parameters, confidence);
    return this.answer();
  }

  begin(row, parameters, confidence) {
    this.machine.reset();
    this.saysKnown?.set([this.known ? 1 : 0]);
    this.set(parameters, confidence);
    this.given.set(row);
    this.machine.start();
  }

  /** Sets physical parameters and the confidence of error bounds, which may change at any time. */
  set(parameters, confidence) {
    if (this.parameters.count > 0) {
      this.parameters.set(parameters);
    }
    if (this.confidence !== null) {
      this.confidence.set([confidence]);
    }
  }

  /** Takes a row of inputs in, and goes on by a time in s. */
  step(row, length) {
    this.given.set(row);
    this.machine.step(length);
    return this.answer();
  }

  /** The same, where the outputs alone are read: what is said of their errors may take far longer. */
  stepBriefly(row, length) {
    this.given.set(row);
    this.machine.step(length);
    return Array.from(this.outputs.get());
  }

  /** What the surrogate says now: { outputs, estimates, bounds, flags }. */
  answer() {
    const values = Array.from(this.read.get());
    const found = {};
    for (const [name, references] of Object.entries(this.groups)) {
      found[name] = values.splice(0, references.length);
    }
    found.flags = Object.fromEntries(this.flags.map((name, i) => [name, found.flags[i]]));
    return found;
  }
}
