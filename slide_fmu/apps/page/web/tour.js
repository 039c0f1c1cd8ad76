// How a page moves by itself: as in the trajectory that the FMU carries, there and back, but more gently.

import { distanceOf } from "./channels.js";

// inputs that move stay of the kind that the surrogate has learnt if they are slower
const DRAWN_OUT = 2;

// held ones do so if they are smaller: held for longer, they are another kind
const SMALLER = 0.6;

/** A Tour goes through the rows of a course, and back through them, over and over. */
export class Tour {
  /** course: { rows }, a step apart, of a trajectory whose kind of inputs the surrogate has learnt. */
  constructor(channels, course, facts) {
    this.channels = channels;
    this.step = facts.step;
    this.held = facts.hold === "zero_order";
    this.rows = course.rows.map((row) => channels.map((channel) => this.gentler(channel, channel.read(row))));
  }

  gentler(channel, value) {
    const middle = (channel.low + channel.high) / 2;
    return this.held && !channel.turns ? middle + SMALLER * (value - middle) : value;
  }

  /** The values of the channels after a time in s. */
  at(time) {
    const last = this.rows.length - 1;
    if (this.held) {
      return this.rows[last - Math.abs(last - (Math.round(time / this.step) % (2 * last)))];
    }
    // it comes to rest where it turns round, and is DRAWN_OUT in the middle
    const turned = (2 * time) / (DRAWN_OUT * this.step * last);
    const place = (last * (1 - Math.cos(turned))) / 2;
    const k = Math.min(Math.floor(place), last - 1);
    const [before, after] = [this.rows[k], this.rows[k + 1]];
    return this.channels.map((channel, i) => before[i] + (place - k) * distanceOf(channel, before[i], after[i]));
  }
}
