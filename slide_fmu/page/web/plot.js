// Plots over time on a canvas, drawn by hand.

import { scaleFor, ticksOf } from "./units.js";

const LEFT = 52;
const RIGHT = 8;
const TOP = 8;
const BOTTOM = 20;

/** The colour that the style sheet gives to a name. */
export function colourOf(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Makes the canvas as sharp as the screen; its context, in CSS pixels, and its size. */
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** The least and the largest finite value of arrays, and of what else is to be seen. */
export function rangeOf(arrays, others = []) {
  let [low, high] = [Infinity, -Infinity];
  const take = (value) => {
    if (Number.isFinite(value)) {
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

function drawAxes(context, frame, { unit, size, about }) {
  const { left, right, top, bottom, x, y, xRange, yRange } = frame;
  const scale = scaleFor(size ?? Math.max(Math.abs(yRange[0]), Math.abs(yRange[1])), unit);
  const yTicks = ticksOf(yRange[0] / scale.factor, yRange[1] / scale.factor, about);
  const xTicks = ticksOf(xRange[0], xRange[1], Math.max(2, (right - left) / 90));
  context.font = "11px system-ui, sans-serif";
  context.strokeStyle = colourOf("grid");
  context.fillStyle = colourOf("faint");
  context.lineWidth = 1;
  context.beginPath();
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of yTicks.values) {
    const at = Math.round(y(value * scale.factor)) + 0.5;
    context.moveTo(left, at);
    context.lineTo(right, at);
    context.fillText(value.toFixed(yTicks.decimals).replace("-", "−"), left - 6, at);
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const value of xTicks.values) {
    const at = Math.round(x(value)) + 0.5;
    context.moveTo(at, top);
    context.lineTo(at, bottom);
    context.fillText(`${value.toFixed(xTicks.decimals)} s`, at, bottom + 4);
  }
  context.stroke();
  context.save();
  context.textBaseline = "top";
  context.textAlign = "left";
  context.fillText(scale.unit, 2, 0);
  context.restore();
}

function trace(context, frame, xs, ys) {
  let pen = false;
  for (let k = 0; k < xs.length; k += 1) {
    const known = Number.isFinite(ys[k]);
    if (known && pen) {
      context.lineTo(frame.x(xs[k]), frame.y(ys[k]));
    } else if (known) {
      context.moveTo(frame.x(xs[k]), frame.y(ys[k]));
    }
    pen = known;
  }
}

function drawBand(context, frame, xs, { low, high, colour }) {
  context.fillStyle = colourOf(colour);
  context.beginPath();
  xs.forEach((x, k) => context.lineTo(frame.x(x), frame.y(high[k])));
  for (let k = xs.length - 1; k >= 0; k -= 1) {
    context.lineTo(frame.x(xs[k]), frame.y(low[k]));
  }
  context.fill();
}

function drawLine(context, frame, xs, { values, colour, width = 1.6, dashed = false }) {
  context.strokeStyle = colourOf(colour);
  context.lineWidth = width;
  context.setLineDash(dashed ? [6, 4] : []);
  context.lineJoin = "round";
  context.beginPath();
  trace(context, frame, xs, values);
  context.stroke();
  context.setLineDash([]);
}

/**
 * Draws lines and bands over time.
 *
 * what: { xs, xRange, yRange, unit, size, lines, bands, cursor, shade }; the first of the lines lies undermost.
 * Lines have { values, colour, width, dashed }, bands { low, high, colour }; colours are names of
 * the style sheet. size: that of values which the prefix of the unit is for, if not those that are
 * seen. cursor: a time that is marked, or null; shade: the time until which the past is
 * not known, or null.
 */
export function drawPlot(canvas, what) {
  const { context, width, height } = prepare(canvas);
  const [left, right, top, bottom] = [LEFT, width - RIGHT, TOP, height - BOTTOM];
  const { xs, xRange, yRange } = what;
  const x = (t) => left + ((t - xRange[0]) / (xRange[1] - xRange[0])) * (right - left);
  const y = (v) => bottom - ((v - yRange[0]) / (yRange[1] - yRange[0])) * (bottom - top);
  const frame = { left, right, top, bottom, x, y, xRange, yRange };
  drawAxes(context, frame, { unit: what.unit, size: what.size, about: Math.max(2, (bottom - top) / 34) });
  context.save();
  context.beginPath();
  context.rect(left, top - 4, right - left, bottom - top + 8);
  context.clip();
  if (what.shade !== null) {
    context.fillStyle = colourOf("shade");
    context.fillRect(left, top - 4, x(what.shade) - left, bottom - top + 8);
  }
  (what.bands ?? []).forEach((band) => drawBand(context, frame, xs, band));
  what.lines.forEach((line) => drawLine(context, frame, xs, line));
  if (what.cursor !== null) {
    context.fillStyle = colourOf("cursor");
    context.fillRect(x(what.cursor) - 0.5, top - 4, 1, bottom - top + 8);
  }
  context.restore();
}

/** The time at a place of a plot that was drawn with a range of times. */
export function timeAt(canvas, clientX, xRange) {
  const box = canvas.getBoundingClientRect();
  const part = (clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
  return xRange[0] + Math.min(Math.max(part, 0), 1) * (xRange[1] - xRange[0]);
}
