// The machine in motion, by a description in plain values (slide_fmu/apps/page/drawing.py).

import { isSeen, prepare } from "../../../core/web/modules/canvases.js";
import { colourOf } from "../../../core/web/modules/colours.js";
import { compilePoints } from "./expressions.js";
import { solidsOf, THINNEST } from "./solids.js";
import { Trail } from "./trail.js";

/** Name of the factor on deflections, which people choose, in the expressions of a drawing. */
const MAGNIFICATION = "magnification";

// between points in space and the edge of the drawing, in m
const ROOM = 0.06;

/** A Drawing shows the machine on a canvas. */
export class Drawing {
  constructor(description, facts, canvas) {
    this.description = description;
    this.canvas = canvas;
    this.magnification = description.magnification ?? 1;
    this.trailing = true;
    const groups = [facts.inputs, facts.outputs, facts.parameters];
    const names = groups.flatMap((group) => group.map(({ name }) => name));
    this.find = compilePoints(description, [...names, MAGNIFICATION]);
    this.trail = new Trail();
    const [left, right, low, high] = description.view;
    canvas.style.aspectRatio = `${right - left} / ${high - low}`;
    if (description.camera !== undefined) {
      const [azimuth, elevation] = description.camera.map((angle) => (angle * Math.PI) / 180);
      this.camera = [azimuth, elevation].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    }
  }

  /** Chooses the factor on deflections. */
  magnify(factor) {
    this.magnification = factor;
    this.trail.forget();
  }

  /** Places on the plane that is drawn on, in m, by the names of the points; the depth is third. */
  places(row, outputs, parameters) {
    const found = this.find([...row, ...outputs, ...parameters, this.magnification]);
    return Object.fromEntries(found.map(([name, point]) => [name, this.seen(point)]));
  }

  /** What a camera sees of a point in space: to the right, upwards, towards the viewer. */
  seen(point) {
    if (this.camera === undefined) {
      return point;
    }
    const [ca, sa, ce, se] = this.camera;
    const [x, y, z] = point;
    const depth = x * ca + y * sa;
    return [y * ca - x * sa, z * ce - depth * se, depth * ce + z * se];
  }

  /** Draws the machine of a run; behind: { row, outputs } of another one behind it, or null. */
  draw(run, parameters, behind) {
    if (!isSeen(this.canvas)) {
      return;
    }
    const places = this.places(run.rows[run.at], run.answers[run.at].outputs, parameters);
    const { context, width, height } = prepare(this.canvas);
    const [left, right, low, high] = this.viewOf(places);
    const scale = Math.min(width / (right - left), height / (high - low));
    context.translate(width / 2, height / 2);
    context.scale(scale, -scale);
    context.translate(-(left + right) / 2, -(low + high) / 2);
    context.lineCap = "round";
    context.lineJoin = "round";
    const { shapes, camera } = this.description;
    const thin = ({ line, width: size }) => line !== undefined && size < THINNEST;
    const solid = camera === undefined ? [] : shapes.filter((shape) => !thin(shape));
    const flat = shapes.filter((shape) => !solid.includes(shape));
    const others = behind === null ? null : this.places(behind.row, behind.outputs, parameters);
    if (others !== null && camera === undefined) {
      this.drawFlat(context, others, shapes, "draw-truth");
    }
    this.drawFlat(context, places, flat, null);
    if (others !== null) {
      this.drawFlat(context, others, solid, "draw-truth");
    }
    const colour = (shape) => colourOf(`draw-${shape.colour}`);
    solidsOf(solid, places, colour).forEach((each) => each.draw(context));
    this.drawTrail(context, run, parameters, 2 / scale);
  }

  /** What is shown of the plane: more than usual where a point in space would be outside. */
  viewOf(places) {
    let [left, right, low, high] = this.description.view;
    for (const [x, y] of this.camera === undefined ? [] : Object.values(places)) {
      [left, right] = [Math.min(left, x - ROOM), Math.max(right, x + ROOM)];
      [low, high] = [Math.min(low, y - ROOM), Math.max(high, y + ROOM)];
    }
    return [left, right, low, high];
  }

  drawTrail(context, run, parameters, width) {
    const { trail } = this.description;
    if (trail !== undefined && this.trailing) {
      const find = (row, outputs) => this.places(row, outputs, parameters)[trail];
      this.trail.draw(context, this.trail.placesOf(run, find), colourOf("draw-trail"), width);
    }
  }

  /** colour: of all shapes; null: their own. */
  drawFlat(context, places, shapes, colour) {
    for (const shape of shapes) {
      context.beginPath();
      if (shape.line !== undefined) {
        shape.line.forEach((name) => context.lineTo(places[name][0], places[name][1]));
        context.strokeStyle = colourOf(colour ?? `draw-${shape.colour}`);
        context.lineWidth = shape.width;
        context.stroke();
      } else {
        const [x, y] = places[shape.disc];
        context.arc(x, y, shape.radius, 0, 2 * Math.PI);
        context.fillStyle = colourOf(colour ?? `draw-${shape.colour}`);
        context.fill();
      }
    }
  }
}
