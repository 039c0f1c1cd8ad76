// The surrogate in real time: inputs follow what people set.

import { distanceOf, Follower } from "./channels.js";

// in one frame: a slow machine falls behind the clock
const MOST_STEPS = 300;

// a tour begins where channels are nearer to its first values than this part of their ranges
const BEGUN = 1e-3;

// the share of the time in which errors and the domain are read: large estimators take milliseconds
const READING = 0.1;

/** A Live run keeps the last seconds of what went in and what came out. */
export class Live {
  /** tour: how inputs move by themselves; null where the FMU carries no trajectory. */
  constructor(session, facts, channels, limits, tour) {
    this.session = session;
    this.facts = facts;
    this.channels = channels;
    this.followers = channels.map((channel, i) => new Follower(channel, limits[i]));
    this.targets = channels.map((channel) => channel.start);
    this.span = Math.min(Math.max(1.2 * facts.past, 6), 20);
    this.wandering = false;
    this.tour = tour;
    this.pace = 1;
  }

  /** Starts anew at 0 s, the inputs where they are set: there they have been for ever before. */
  restart(parameters, confidence) {
    this.toured = null;
    if (this.wandering && this.tour !== null) {
      this.targets = [...this.tour.at(0)];
    }
    this.followers.forEach((follower, i) => follower.place(this.targets[i]));
    const row = this.row();
    // what is set is all that inputs do in a step
    this.session.known = true;
    this.session.begin(row, parameters, confidence);
    this.session.known = false;
    for (let past = 0; past < this.facts.past + this.facts.step; past += this.facts.step) {
      this.session.stepBriefly(row, this.facts.step);
    }
    this.time = [0];
    this.rows = [row];
    this.answers = [this.session.answer()];
    this.owed = 0;
    this.readAt = 0;
    this.wanderAt = 2 * this.facts.step; // the first input counts as held for ever before
  }

  row() {
    const row = this.facts.inputs.map((input) => input.start);
    this.channels.forEach((channel, i) => channel.write(this.followers[i].value, row));
    return row;
  }

  get now() {
    return this.time.at(-1);
  }

  /** Goes on with the clock, by so many seconds of it; true when there are new answers. */
  advance(seconds) {
    this.owed += Math.min(seconds, 0.25) * this.pace;
    let left = MOST_STEPS;
    const before = this.now;
    while (this.owed >= this.facts.step && left > 0) {
      this.owed -= this.facts.step;
      left -= 1;
      this.step();
    }
    this.owed = Math.min(this.owed, this.facts.step);
    return this.now > before;
  }

  step() {
    const { step } = this.facts;
    if (this.wandering && this.tour !== null && this.toured !== null) {
      this.toured += step;
      this.targets = [...this.tour.at(this.toured)];
      this.followers.forEach((follower, i) => follower.place(this.targets[i]));
    } else {
      if (this.wandering) {
        this.wander();
      }
      this.followers.forEach((follower, i) => follower.advance(this.targets[i], step));
    }
    const row = this.row();
    this.answers.push(this.answer(row));
    this.rows.push(row);
    this.time.push(this.now + step);
    while (this.time.length > 2 && this.now - this.time[0] > this.span) {
      this.time.shift();
      this.rows.shift();
      this.answers.shift();
    }
  }

  /** What the surrogate says; errors and the domain as last read, until there is time for them. */
  answer(row) {
    const { step } = this.facts;
    if (performance.now() < this.readAt) {
      return { ...this.answers.at(-1), outputs: this.session.stepBriefly(row, step) };
    }
    const begin = performance.now();
    const answer = this.session.step(row, step);
    const end = performance.now();
    this.readAt = end + (end - begin) * (1 / READING - 1);
    return answer;
  }

  /** Lets inputs move by themselves, or not any more. */
  letWander(on) {
    this.wandering = on;
    this.toured = null;
  }

  /** Goes to where the tour begins; without one, now and then sets one input anew. */
  wander() {
    if (this.tour !== null) {
      this.targets = [...this.tour.at(0)];
      const isThere = (channel, i) =>
        this.followers[i].limits === null ||
        Math.abs(distanceOf(channel, this.followers[i].value, this.targets[i])) < BEGUN * (channel.high - channel.low);
      this.toured = this.channels.every(isThere) ? 0 : null;
      return;
    }
    if (this.now < this.wanderAt) {
      return;
    }
    const i = Math.floor(Math.random() * this.channels.length);
    const { low, high } = this.channels[i];
    this.targets[i] = (low + high) / 2 + (Math.random() - 0.5) * 0.8 * (high - low);
    this.wanderAt = this.now + (0.2 + Math.random()) * Math.min(this.facts.past / 4, 2);
  }
}
