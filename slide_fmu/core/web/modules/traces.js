// Traces: bands, lines, steps and points, on a canvas whose frame says where values lie.

/** Lists the places that are known, in parts without a gap: [[x, y], ...] each. */
function partsOf(frame, xs, values) {
  const parts = [];
  let open = null;
  for (let k = 0; k < xs.length; k += 1) {
    if (values[k] === null || !Number.isFinite(values[k]) || xs[k] === null) {
      open = null;
      continue;
    }
    if (open === null) {
      open = [];
      parts.push(open);
    }
    open.push([frame.x(xs[k]), frame.y(values[k])]);
  }
  return parts;
}

/** A value holds from the place before to its own: it was set at the step that led there. */
function stepped(part) {
  return part.flatMap(([x, y], k) => (k === 0 ? [[x, y]] : [[part[k - 1][0], y], [x, y]]));
}

/** A value holds from its own place to the next one: it was set there. */
function held(part) {
  return part.flatMap(([x, y], k) => (k === 0 ? [[x, y]] : [[x, part[k - 1][1]], [x, y]]));
}

const WAYS_ON = { line: (part) => part, steps: stepped, held };

function drawPoints(context, frame, xs, { values, paint, width = 1.5 }) {
  context.fillStyle = paint;
  context.globalAlpha = width > 2 ? 1 : 0.55;
  for (const [x, y] of partsOf(frame, xs, values).flat()) {
    context.beginPath();
    context.arc(x, y, width, 0, 2 * Math.PI);
    context.fill();
  }
  context.globalAlpha = 1;
}

function drawBand(context, frame, xs, { low, high, paint }) {
  context.fillStyle = paint;
  context.beginPath();
  const known = xs.map((_, k) => k).filter((k) => Number.isFinite(high[k]) && high[k] !== null);
  known.forEach((k) => context.lineTo(frame.x(xs[k]), frame.y(high[k])));
  known.reverse().forEach((k) => context.lineTo(frame.x(xs[k]), frame.y(low[k])));
  context.fill();
}

function drawLine(context, frame, xs, { values, paint, width = 1.6, dashed = false, style = "line" }) {
  context.strokeStyle = paint;
  context.lineWidth = width;
  context.setLineDash(dashed ? [6, 4] : []);
  context.lineJoin = "round";
  context.beginPath();
  for (const part of partsOf(frame, xs, values)) {
    WAYS_ON[style](part).forEach(([x, y], k) =>
      k === 0 ? context.moveTo(x, y) : context.lineTo(x, y),
    );
  }
  context.stroke();
  context.setLineDash([]);
}

/** Draws a band, points, or a line, in the colour `paint`. */
export function drawTrace(context, frame, xs, trace) {
  if (trace.high !== undefined) {
    drawBand(context, frame, xs, trace);
  } else if (trace.style === "points") {
    drawPoints(context, frame, xs, trace);
  } else {
    drawLine(context, frame, xs, trace);
  }
}
