// One move after another is tried with the surrogate: when does it stand still?

// it must stand still for so long, in s, to count while moves are compared
const LOOKED_ON = 0.5;

// from an error estimate, an RMS, to a margin, where there is no bound: slide_fmu/apps/motion/margin.py
const ESTIMATES = 2;

/** The largest error that is expected of an answer, as a norm over the outputs; 0 where none is known. */
export function marginOf({ bounds, estimates }, { usual }) {
  return bounds.length > 0 ? Math.hypot(...bounds) : ESTIMATES * (usual ?? Math.hypot(...estimates));
}

/** Whether the surrogate knows the inputs before an answer. */
export function isKnown(flags) {
  return (flags.in_domain ?? flags.inputs_in_range) === 1;
}

/** A Rehearsal tries moves from rest at a start to rest at a goal; both are rows of inputs. */
export class Rehearsal {
  /** task: { channels, start, goal: values of channels, ways, tolerance, parameters, confidence }. */
  constructor(session, facts, task) {
    Object.assign(this, { session, facts, task });
    this.step = facts.step;
    this.memory = Math.max(LOOKED_ON, facts.memory);
    // a move is planned: inputs that move are set one step ahead
    this.begin = facts.hold === "first_order" ? -this.step : 0;
    session.known = true;
    const goal = this.row(1);
    session.begin(goal, task.parameters, task.confidence);
    this.rest = session.step(goal, this.step);
    session.known = false;
  }

  /** Inputs after a share of the way. */
  row(share) {
    const { channels, start, ways } = this.task;
    const row = this.facts.inputs.map((input) => input.start);
    channels.forEach((channel, i) => channel.write(start[i] + share * ways[i], row));
    return row;
  }

  /** The share of the way at sample k of a move, { profile, time, impulses: [delay, part] }. */
  static share({ profile, time, impulses }, moment) {
    return impulses.reduce(
      (sum, [delay, part]) => sum + part * profile.way(Math.max(moment - delay, 0) / time),
      0,
    );
  }

  /** The first sample at which a move has come to its goal, and the time then. */
  arrival({ time, impulses }) {
    const done = time + impulses.at(-1)[0];
    const sample = Math.ceil(done / this.step - 1e-9);
    return { sample, moment: Math.max(sample, 1) * this.step };
  }

  /** Answers of the surrogate to a move, as [sample, answer], from a sample on; there is no end. */
  *answers(move, from) {
    const { session, step, task } = this;
    const [start, goal] = [this.row(0), this.row(1)];
    const arrives = this.arrival(move).sample;
    session.known = true;
    session.begin(start, task.parameters, task.confidence);
    session.known = false;
    session.stepBriefly(start, step);
    for (let k = 1; ; k += 1) {
      const row = k >= arrives ? goal : this.row(Rehearsal.share(move, k * step));
      if (k < from) {
        session.stepBriefly(row, step);
      } else {
        yield [k, session.step(row, step)];
      }
    }
  }

  /**
   * When a move stands still, its margin included, in s; Infinity if that is later than a time in s.
   * Between samples the distance from rest counts as straight, so that of two moves one is nearly
   * always earlier.
   */
  settled(move, latest, looked = LOOKED_ON) {
    const { step } = this;
    const { tolerance } = this.task;
    const arrives = this.arrival(move);
    const later = this.facts.hold === "first_order" ? 0 : step;
    let found = arrives.moment + later;
    let part = 0; // of a step, that it stands still before that
    let before = Infinity;
    if (found > latest) {
      return Infinity;
    }
    for (const [k, answer] of this.answers(move, Math.max(arrives.sample, 1))) {
      const moment = k * step + later;
      const away = this.distance(answer.outputs) + marginOf(answer, this.facts);
      if (away > tolerance) {
        if (moment > latest) {
          return Infinity;
        }
        [found, part, before] = [moment + step, 0, away];
      } else if (Math.abs(moment - found) < 1e-9 && before > tolerance) {
        part = (tolerance - away) / (before - away);
      }
      if (moment >= found + looked - 1e-9) {
        return found - part * step;
      }
    }
  }

  /** The same for a move that would be the best: it is looked on for longer, and must be known. */
  trusted(move, latest) {
    return this.knows(move) ? this.settled(move, latest, this.memory) : Infinity;
  }

  /** Whether the surrogate knows the inputs until they no longer change the outputs. */
  knows(move) {
    const last = this.arrival(move).sample + Math.ceil(this.memory / this.step);
    for (const [k, { flags }] of this.answers(move, 1)) {
      if (!isKnown(flags)) {
        return false;
      }
      if (k >= last) {
        return true;
      }
    }
  }

  distance(outputs) {
    return Math.hypot(...outputs.map((y, i) => y - this.rest.outputs[i]));
  }

  /** A move as pages carry it: { name, arrives, inputs: columns } at times. */
  written(name, move, count) {
    const rows = Array.from({ length: count }, (_, k) => this.row(k < 1 ? 0 : Rehearsal.share(move, k * this.step)));
    const later = this.facts.hold === "first_order" ? 0 : this.step;
    const inputs = this.facts.inputs.map((_, i) => rows.map((row) => row[i]));
    return { name, arrives: this.arrival(move).moment + later, inputs };
  }
}
