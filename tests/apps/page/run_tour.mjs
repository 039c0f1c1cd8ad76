// Lets a page's inputs move by themselves for a time, and prints the share of steps that it trusts.
//
// task, a JSON file: { runtime, surrogate: paths, facts, files: texts of the stored trajectory, seconds }.

import { readFileSync } from "node:fs";
import { channelsOf, limitsOf } from "../../../slide_fmu/apps/page/web/channels.js";
import { storedCourse } from "../../../slide_fmu/apps/page/web/course.js";
import { Live } from "../../../slide_fmu/apps/page/web/live.js";
import { loadRuntime, Machine } from "../../../slide_fmu/apps/page/web/machine.js";
import { Session } from "../../../slide_fmu/apps/page/web/session.js";
import { Tour } from "../../../slide_fmu/apps/page/web/tour.js";
import { verdictOf } from "../../../slide_fmu/apps/page/web/trust.js";

const { runtime, surrogate, facts, files, seconds } = JSON.parse(readFileSync(process.argv[2], "utf-8"));
const machine = new Machine(await loadRuntime(readFileSync(runtime)), readFileSync(surrogate));
const channels = channelsOf(facts);
const course = storedCourse(facts, files);
const limits = channels.map((channel) => limitsOf(channel, facts, course));
const live = new Live(new Session(machine, facts), facts, channels, limits, new Tour(channels, course, facts));
live.letWander(true);
live.restart(facts.parameters.map((parameter) => parameter.start), facts.confidence?.start ?? 0);
const steps = Math.ceil(seconds / facts.step);
const moved = channels.map(() => [Infinity, -Infinity]);
let trusted = 0;
for (let k = 0; k < steps; k += 1) {
  live.readAt = 0; // a page reads less often
  live.step();
  trusted += verdictOf(live.answers.at(-1).flags).state === "good" ? 1 : 0;
  live.followers.forEach(({ value }, i) => {
    moved[i] = [Math.min(moved[i][0], value), Math.max(moved[i][1], value)];
  });
}
const part = channels.map(({ low, high }, i) => (moved[i][1] - moved[i][0]) / (high - low));
console.log(JSON.stringify({ trusted: trusted / steps, moved: Math.max(...part) }));
