// Plots on a canvas, drawn by hand: axes, and the course of lines and bands over them.

import { axisOf, linearTicks, logTicks } from "./axes.js";
import { isSeen, prepare } from "./canvases.js";
import { colourOf } from "./colours.js";
import { drawTrace } from "./traces.js";
import { placeText, scaleFor } from "./units.js";

const LEFT = 52;
const RIGHT = 8;
const TOP = 8;
const UNIT = 12; // the height of the unit, which stands above the y axis
const BOTTOM = 20;
const LOW = 40; // a plot of less height has room for fewer numbers
const GAP = 6; // between the y axis and its numbers

/** Numbers of a logarithmic axis have units of their own where these may have prefixes. */
const hasOwnUnits = (unit, yLog) => yLog && placeText(1, unit) !== null;

/** The place of the upper end of the y axis. */
function topOf(unit, yLog) {
  return unit === "" || unit === "1" || hasOwnUnits(unit, yLog) ? TOP : TOP + UNIT;
}

function drawXAxis(context, frame, { xUnit = "s", xLog = false }) {
  const { left, right, top, bottom, x, xRange } = frame;
  const about = Math.max(2, (right - left) / 90);
  const ticks = xLog ? logTicks(xRange, about) : linearTicks(xRange, about);
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const { value, text } of ticks) {
    const at = Math.round(x(value)) + 0.5;
    const words = `${text} ${xUnit}`.trim();
    const half = context.measureText(words).width / 2;
    context.moveTo(at, top);
    context.lineTo(at, bottom);
    const least = left - GAP + half; // farther left it would meet the lowest number of the y axis
    context.fillText(words, Math.max(least, Math.min(at, right + RIGHT - half)), bottom + 4);
  }
}

function drawYAxis(context, frame, { unit, size, yLog = false }) {
  const { left, right, top, bottom, y, yRange } = frame;
  const largest = size ?? Math.max(Math.abs(yRange[0]), Math.abs(yRange[1]));
  const scale = yLog ? { factor: 1, unit: unit === "1" ? "" : unit } : scaleFor(largest, unit);
  const shown = yRange.map((value) => value / scale.factor);
  const about = Math.max(bottom - top < LOW ? 2 : 3, (bottom - top) / 34);
  const ticks = yLog ? logTicks(shown, about) : linearTicks(shown, about);
  const own = hasOwnUnits(unit, yLog);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const { value, text } of ticks) {
    const at = Math.round(y(value * scale.factor)) + 0.5;
    context.moveTo(left, at);
    context.lineTo(right, at);
    context.fillText(own ? placeText(value, unit) : text, left - GAP, at);
  }
  context.textBaseline = "top";
  context.textAlign = "left";
  context.fillText(own ? "" : scale.unit, 2, 0);
}

function drawAxes(context, frame, what) {
  context.font = "11px system-ui, sans-serif";
  context.strokeStyle = colourOf("grid");
  context.fillStyle = colourOf("faint");
  context.lineWidth = 1;
  context.beginPath();
  drawYAxis(context, frame, what);
  drawXAxis(context, frame, what);
  context.stroke();
}

/** Shades a part of the plot over all its height. */
function shadePart(context, frame, from, to, colour) {
  context.fillStyle = colour;
  context.fillRect(frame.x(from), frame.top - 4, frame.x(to) - frame.x(from), frame.bottom - frame.top + 8);
}

function drawMark(context, frame, place) {
  context.strokeStyle = colourOf("cursor");
  context.lineWidth = 1;
  context.setLineDash([2, 3]);
  context.beginPath();
  context.moveTo(frame.x(place), frame.top - 4);
  context.lineTo(frame.x(place), frame.bottom + 4);
  context.stroke();
  context.setLineDash([]);
}

/**
 * Draws lines and bands, over time if nothing else is said.
 *
 * what: { xs, xRange, yRange, xUnit, xLog, unit, yLog, size, lines, bands, cursor, shade, parts,
 * marks };
 * the first of the lines lies undermost. Lines have { values, xs, colour, width, dashed, style },
 * bands { low, high, xs, colour }; their own xs are taken before those of all; colours are names of
 * the style sheet. size: that of values which the prefix of the unit is for, if not those that are
 * seen. cursor: a place of the x axis that is marked, or null; shade: the time until which the
 * past is not known, or null; parts: pairs of places between which the plot is shaded; marks:
 * places with a dotted line.
 */
export function drawPlot(canvas, what) {
  if (!isSeen(canvas)) {
    return;
  }
  const { context, width, height } = prepare(canvas);
  const [left, right, top, bottom] = [LEFT, width - RIGHT, topOf(what.unit, what.yLog), height - BOTTOM];
  const { xRange, yRange } = what;
  const x = axisOf(xRange, [left, right], what.xLog);
  const y = axisOf(yRange, [bottom, top], what.yLog);
  const frame = { left, right, top, bottom, x, y, xRange, yRange };
  drawAxes(context, frame, what);
  context.save();
  context.beginPath();
  context.rect(left, top - 4, right - left, bottom - top + 8);
  context.clip();
  const parts = what.shade === null ? [] : [[xRange[0], what.shade]];
  for (const [from, to] of [...parts, ...(what.parts ?? [])]) {
    shadePart(context, frame, from, to, colourOf("shade"));
  }
  for (const trace of [...(what.bands ?? []), ...what.lines]) {
    drawTrace(context, frame, trace.xs ?? what.xs, { ...trace, paint: colourOf(trace.colour) });
  }
  for (const place of what.marks ?? []) {
    drawMark(context, frame, place);
  }
  if (what.cursor !== null) {
    context.fillStyle = colourOf("cursor");
    context.fillRect(x(what.cursor) - 0.5, top - 4, 1, bottom - top + 8);
  }
  context.restore();
}

/** The place of the x axis at a place of a plot that was drawn with a range. */
export function placeAt(canvas, clientX, xRange, xLog = false) {
  const box = canvas.getBoundingClientRect();
  const part = Math.min(Math.max((clientX - box.left - LEFT) / (box.width - LEFT - RIGHT), 0), 1);
  const [from, to] = xLog ? xRange.map(Math.log) : xRange;
  const found = from + part * (to - from);
  return xLog ? Math.exp(found) : found;
}
