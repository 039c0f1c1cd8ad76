// A thousand shaped moves are tried for the one that stands still first: slide_fmu/apps/motion/choice.py.

import { fastestProfile, LEAST_ROUNDED, Profile } from "./profiles.js";

const CANDIDATES = 1000;
const BEST = 20;
const NEAR = 0.06;
const LONGEST = 1.5;
const DIMENSIONS = 6;
const PERIODS = 40;
const DAMPED = [1, 0.9, 0.75];

// if moves leave what the surrogate knows, slower ones are tried: slide_fmu/apps/motion/earliest_move.py
const SLOWER = [1, 1.5, 2, 3];

/** Shapers of two and of three impulses for a vibration with half a period in s. */
function* shapersTo(longest, step) {
  for (let k = 0; k < PERIODS; k += 1) {
    const half = step * (longest / step) ** (k / (PERIODS - 1));
    for (const left of DAMPED) {
      const all = 1 + left;
      yield ["ZV shaper", [[0, 1 / all], [half, left / all]]];
      const parts = [1, 2 * left, left * left].map((part) => part / all ** 2);
      yield ["ZVD shaper", parts.map((part, i) => [i * half, part])];
    }
  }
}

/** Evenly spread places of a cube (Roberts' sequence: powers of the root of x^(n+1) = x + 1). */
function placeOf(index) {
  let root = 1.1;
  for (let k = 0; k < 40; k += 1) {
    root = (1 + root) ** (1 / (DIMENSIONS + 1));
  }
  return Array.from({ length: DIMENSIONS }, (_, i) => (0.5 + (index + 1) / root ** (i + 1)) % 1);
}

/** A move by its place in a cube; most lie near the fastest profile. */
function moveAt(place, fastest, latest, { ways, limits, step }, slower) {
  const phase = (drawn) => Math.min(fastest.speeding * 4 ** (drawn - 0.5), 0.5);
  const rounded = LEAST_ROUNDED + (1 - LEAST_ROUNDED) * place[2] ** 2;
  const profile = new Profile(phase(place[0]), phase(place[1]), rounded);
  const time = slower * Math.max(profile.leastTime(ways, limits), step) * LONGEST ** (place[3] ** 2);
  const first = 0.5 + 0.5 * place[5];
  return { profile, time, impulses: [[0, first], [place[4] * latest, 1 - first]] };
}

/**
 * Finds plain, best shaper, and optimised: { slower, found: { name, move, settled } each }, with
 * their margins. The last two are known to the surrogate, or have no time; slower: the factor on
 * the shortest time with which moves begin. A generator, which gives the share that is done after
 * every try, so that a page can go on meanwhile.
 */
export function* search(rehearsal, task) {
  let found = [];
  for (const slower of SLOWER) {
    found = yield* searchFrom(rehearsal, task, slower);
    if (Number.isFinite(found[0].settled)) {
      return { slower, found };
    }
  }
  return { slower: SLOWER.at(-1), found };
}

function* searchFrom(rehearsal, task, slower) {
  const { ways, limits, step } = task;
  const fastest = fastestProfile(ways, limits);
  const time = slower * Math.max(fastest.leastTime(ways, limits), step);
  const alone = { profile: fastest, time, impulses: [[0, 1]] };
  const longest = Math.max(time, 10 * step);
  const last = 20 * time + 60 * step;
  const plain = { name: "fastest profile", move: alone, settled: rehearsal.settled(alone, last) };
  const far = Math.min(2 * plain.settled, last);
  const total = 2 * PERIODS * DAMPED.length + CANDIDATES;
  let tried = 0;
  // until a move is known that stands still, what is not known is left at once
  const settledOf = (move, latest, known) =>
    Number.isFinite(known.settled) || rehearsal.knows(move) ? rehearsal.settled(move, latest) : Infinity;
  // a move is looked at closely where it seems to be the best
  const better = (known, name, move, settled) => {
    const sure = settled < known.settled ? rehearsal.trusted(move, known.settled) : Infinity;
    return sure < known.settled ? { name, move, settled: sure } : known;
  };
  let shaped = { name: "", move: null, settled: Infinity };
  for (const [name, impulses] of shapersTo(longest, step)) {
    const move = { profile: fastest, time, impulses };
    shaped = better(shaped, name, move, settledOf(move, Math.min(shaped.settled, far), shaped));
    tried += 1;
    yield tried / total;
  }
  const latest = 1.5 * (shaped.move?.impulses.at(-1)[0] ?? longest);
  let best = { ...better(shaped, "", alone, plain.settled), name: "optimised" };
  const found = [];
  for (let k = 0; k < CANDIDATES; k += 1) {
    let place = placeOf(k);
    if (k >= CANDIDATES / 2) {
      const near = found[k % Math.min(BEST, found.length)]?.place ?? place;
      place = near.map((at, i) => Math.min(Math.max(at + NEAR * (2 * place[i] - 1), 0), 1));
    }
    const move = moveAt(place, fastest, latest, task, slower);
    // while the first half is spread, somewhat later ones may have a better neighbour
    const settled = settledOf(move, Math.min(1.2 * best.settled, far), best);
    if (Number.isFinite(settled)) {
      found.push({ place, settled });
      found.sort((a, b) => a.settled - b.settled);
    }
    best = better(best, "optimised", move, settled);
    tried += 1;
    yield tried / total;
  }
  return [best, shaped, plain];
}
