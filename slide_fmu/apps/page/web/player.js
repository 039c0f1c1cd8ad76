// A record is shown as a film: which of its times is marked, and how that goes on.

import { byId } from "../../../core/web/modules/elements.js";

/** A Player marks a time of a course. */
export class Player {
  constructor() {
    this.course = null;
    this.time = 0;
  }

  /** Takes a course, and marks its end. */
  take(course) {
    this.course = course;
    this.time = course.xRange[1];
    const slider = byId("time");
    [slider.min, slider.max] = course.xRange;
    slider.step = "any";
  }

  /** Index of the answer at the time that is marked. */
  get at() {
    const found = this.course.time.findIndex((time) => time >= this.time - 1e-9);
    return found < 0 ? this.course.time.length - 1 : found;
  }

  get atEnd() {
    return this.time >= this.course.xRange[1];
  }

  /** Marks a time, which may be said by people. */
  go(time) {
    const [begin, end] = this.course.xRange;
    this.time = Math.min(Math.max(time, begin), end);
  }
}
