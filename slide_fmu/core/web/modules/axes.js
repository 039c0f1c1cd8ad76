// Axes: where values lie, which range is shown, and what is written beside it.

import { ticksOf } from "./units.js";

const MINUS = "−";
const MOST_DIGITS = 4; // decimals of a number that fits beside an axis, or digits but for the first
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** The way from values of a range to places between two pixels, on a logarithmic axis or not. */
export function axisOf([low, high], [from, to], log = false) {
  const map = log ? (v) => Math.log(Math.max(v, Number.MIN_VALUE)) : (v) => v;
  const [begin, end] = [map(low), map(high)];
  return (value) => from + ((map(value) - begin) / (end - begin)) * (to - from);
}

/** The least and the largest finite value of arrays, and of what else is to be seen. */
export function rangeOf(arrays, others = []) {
  let [low, high] = [Infinity, -Infinity];
  const take = (value) => {
    if (Number.isFinite(value) && value !== null) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  };
  others.forEach(take);
  arrays.forEach((array) => array.forEach(take));
  return [low, high];
}

/** A range with some room about it, never empty. */
export function widened([low, high], least) {
  const middle = Number.isFinite(low) ? (low + high) / 2 : 0;
  const half = Math.max(Number.isFinite(low) ? 0.55 * (high - low) : 0, least / 2, 1e-12);
  return [middle - half, middle + half];
}

/** The same of a logarithmic axis: the range of positive values, with some room. */
export function widenedLog([low, high]) {
  if (!(low > 0) || !Number.isFinite(high)) {
    return [1, 10];
  }
  const room = Math.max((high / low) ** 0.05, 1.2);
  return [low / room, high * room];
}

/** Ticks of an even axis: { value, text }, about so many. */
export function linearTicks([low, high], about) {
  const few = ticksOf(low, high, about);
  const { values, decimals } = few.values.length > 1 ? few : ticksOf(low, high, 2 * about);
  const power = Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high))));
  const step = values.length > 1 ? values[1] - values[0] : 10 ** power;
  const places = Math.max(0, power - Math.floor(Math.log10(step * 1.001)));
  if ((power > MOST_DIGITS || decimals > MOST_DIGITS) && places < 2) {
    return values.map((value) => ({ value, text: partText(value / 10 ** power, power, places) }));
  }
  return values.map((value) => ({ value, text: value.toFixed(decimals).replace("-", MINUS) }));
}

/** Ticks of a logarithmic axis, about so many: powers of ten, and some between where there is room. */
export function logTicks([low, high], about) {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const every = Math.ceil((last - first) / (about + 1));
  for (const parts of [[1, 2, 5], [1]]) {
    const ticks = [];
    for (let power = first; power <= last; power += parts.length > 1 ? 1 : every) {
      ticks.push(...parts.map((part) => ({ value: part * 10 ** power, text: powerText(part, power) })));
    }
    const seen = ticks.filter(({ value }) => value >= 0.999 * low && value <= 1.001 * high);
    if (seen.length < 2) {
      return linearTicks([low, high], about).filter(({ value }) => value > 0);
    }
    if (seen.length <= about + 2 || parts.length === 1) {
      return seen;
    }
  }
  return [];
}

/** A tick as a part of a power of ten, the same one for all of an axis: "2.5·10⁻⁶". */
function partText(part, power, places) {
  const text = `${part.toFixed(places)}·${tenTo(power)}`.replace("-", MINUS);
  return Math.abs(part) < 1e-9 ? "0" : text;
}

function tenTo(power) {
  const raised = [...String(Math.abs(power))].map((digit) => RAISED[Number(digit)]).join("");
  return `10${power < 0 ? "⁻" : ""}${raised}`;
}

function powerText(part, power) {
  if (power >= -2 && power <= 3) {
    return (part * 10 ** power).toFixed(Math.max(0, -power));
  }
  return `${part === 1 ? "" : `${part}·`}${tenTo(power)}`;
}
