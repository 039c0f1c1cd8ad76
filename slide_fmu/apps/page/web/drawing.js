// The machine in motion, by a description in plain values (slide_fmu/apps/page/drawing.py).

import { isSeen, prepare } from "../../../core/web/modules/canvases.js";
import { colourOf } from "../../../core/web/modules/colours.js";

const OPERATIONS = {
  "+": (a, b) => a + b,
  "-": (a, b) => a - b,
  "*": (a, b) => a * b,
  "/": (a, b) => a / b,
  sqrt: (a) => Math.sqrt(Math.max(a, 0)),
  sin: Math.sin,
  cos: Math.cos,
};

function valueOf(expression, known) {
  if (typeof expression === "number") {
    return expression;
  }
  if (typeof expression === "string") {
    return known.get(expression);
  }
  const [operation, ...parts] = expression;
  return OPERATIONS[operation](...parts.map((part) => valueOf(part, known)));
}

/** A Drawing shows the machine on a canvas. */
export class Drawing {
  constructor(description, facts, canvas) {
    this.description = description;
    this.names = {
      inputs: facts.inputs.map((input) => input.name),
      outputs: facts.outputs.map((output) => output.name),
      parameters: facts.parameters.map((parameter) => parameter.name),
    };
    this.canvas = canvas;
    const [left, right, low, high] = description.view;
    canvas.style.aspectRatio = `${right - left} / ${high - low}`;
  }

  /** Places on the plane that is drawn on, in m, by the names of the points. */
  places(row, outputs, parameters) {
    const known = new Map();
    const learn = (names, values) => names.forEach((name, i) => known.set(name, values[i]));
    learn(this.names.inputs, row);
    learn(this.names.outputs, outputs);
    learn(this.names.parameters, parameters);
    for (const [name, expression] of this.description.values) {
      known.set(name, valueOf(expression, known));
    }
    return Object.fromEntries(
      Object.entries(this.description.points).map(([name, coordinates]) => [
        name,
        this.flat(coordinates.map((coordinate) => valueOf(coordinate, known))),
      ]),
    );
  }

  /** What a camera sees of a point in space. */
  flat(point) {
    if (this.description.camera === undefined) {
      return point;
    }
    const [azimuth, elevation] = this.description.camera.map((angle) => (angle * Math.PI) / 180);
    const [x, y, z] = point;
    const depth = x * Math.cos(azimuth) + y * Math.sin(azimuth);
    const right = y * Math.cos(azimuth) - x * Math.sin(azimuth);
    return [right, z * Math.cos(elevation) - depth * Math.sin(elevation)];
  }

  /** Draws the machine; behind: { row, outputs } of another one behind it, or null. */
  draw(row, outputs, parameters, behind) {
    const { context, width, height } = prepare(this.canvas);
    const [left, right, low, high] = this.description.view;
    const scale = Math.min(width / (right - left), height / (high - low));
    context.translate(width / 2, height / 2);
    context.scale(scale, -scale);
    context.translate(-(left + right) / 2, -(low + high) / 2);
    context.lineCap = "round";
    context.lineJoin = "round";
    if (behind !== null) {
      const places = this.places(behind.row, behind.outputs, parameters);
      this.drawShapes(context, places, "draw-truth");
    }
    this.drawShapes(context, this.places(row, outputs, parameters), null);
  }

  /** colour: of all shapes; null: their own. */
  drawShapes(context, places, colour) {
    for (const shape of this.description.shapes) {
      context.beginPath();
      if (shape.line !== undefined) {
        shape.line.forEach((name) => context.lineTo(...places[name]));
        context.strokeStyle = colourOf(colour ?? `draw-${shape.colour}`);
        context.lineWidth = shape.width;
        context.stroke();
      } else {
        context.arc(...places[shape.disc], shape.radius, 0, 2 * Math.PI);
        context.fillStyle = colourOf(colour ?? `draw-${shape.colour}`);
        context.fill();
      }
    }
  }
}
