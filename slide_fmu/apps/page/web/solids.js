// Links in space, shaded as round rods: the light comes from the left above the viewer.

const LIGHT = [-0.453, 0.655, 0.605]; // to the right, upwards, towards the viewer
const HALFWAY = [-0.253, 0.366, 0.896]; // between the light and the viewer
const STOPS = [-1, -0.75, -0.45, -0.1, 0.25, 0.6, 0.85, 1];

/** Thinner lines are drawn flat. */
export const THINNEST = 0.02;

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** The parts of a colour "#rrggbb". */
function partsOfColour(text) {
  return [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16));
}

/** A colour as it looks where a surface has a normal. */
function shaded(parts, normal) {
  const bright = 0.66 + 0.4 * Math.max(dot(normal, LIGHT), 0);
  const gloss = 0.35 * Math.max(dot(normal, HALFWAY), 0) ** 24;
  const [r, g, b] = parts.map((part) => {
    const dull = Math.min(part * bright, 255);
    return Math.round(dull + gloss * (255 - dull));
  });
  return `rgb(${r} ${g} ${b})`;
}

/** Draws a ball about a place [x, y, depth]. */
export function drawBall(context, [x, y], radius, colour) {
  const parts = partsOfColour(colour);
  const [u, v] = [0.45 * LIGHT[0] * radius, 0.45 * LIGHT[1] * radius];
  const paint = context.createRadialGradient(x + u, y + v, 0, x, y, radius);
  paint.addColorStop(0, shaded(parts, HALFWAY));
  paint.addColorStop(0.3, shaded(parts, LIGHT));
  paint.addColorStop(1, shaded(parts, [0.5, -0.6, 0.6]));
  context.fillStyle = paint;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

/** Draws a rod with round ends from one place to another, each [x, y, depth]. */
export function drawRod(context, from, to, width, colour) {
  const way = to.map((value, i) => value - from[i]);
  const [length, flat] = [Math.hypot(...way), Math.hypot(way[0], way[1])];
  const radius = width / 2;
  if (flat < 0.02 * width) {
    drawBall(context, to[2] > from[2] ? to : from, radius, colour);
    return;
  }
  const parts = partsOfColour(colour);
  const side = [-way[1] / flat, way[0] / flat];
  // the direction across the rod that points to the viewer
  const slope = way[2] / length;
  const front = [(-way[0] / flat) * slope, (-way[1] / flat) * slope, flat / length];
  const [x, y] = from;
  const paint = context.createLinearGradient(
    ...[x - radius * side[0], y - radius * side[1], x + radius * side[0], y + radius * side[1]],
  );
  for (const at of STOPS) {
    const up = Math.sqrt(1 - at * at);
    const normal = [at * side[0] + up * front[0], at * side[1] + up * front[1], up * front[2]];
    paint.addColorStop((at + 1) / 2, shaded(parts, normal));
  }
  context.strokeStyle = paint;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(to[0], to[1]);
  context.stroke();
}

/** The rods and balls of shapes, the farthest first: { depth, draw }. */
export function solidsOf(shapes, places, colourOfShape) {
  const found = [];
  for (const shape of shapes) {
    const colour = colourOfShape(shape);
    if (shape.disc !== undefined) {
      const place = places[shape.disc];
      const draw = (context) => drawBall(context, place, shape.radius, colour);
      found.push({ depth: place[2] + shape.radius, draw });
      continue;
    }
    for (let k = 0; k + 1 < shape.line.length; k += 1) {
      const [from, to] = [places[shape.line[k]], places[shape.line[k + 1]]];
      const draw = (context) => drawRod(context, from, to, shape.width, colour);
      found.push({ depth: (from[2] + to[2]) / 2, draw });
    }
  }
  return found.sort((a, b) => a.depth - b.depth);
}
