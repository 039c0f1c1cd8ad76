// The way that a point of the machine has gone lately.

const SECONDS = 2;
const PARTS = 16; // of the trail, each fainter than the one after it

/** A Trail keeps where the point was at each answer of a run, since finding it takes long. */
export class Trail {
  constructor() {
    this.forget();
  }

  /** Forgets places: they would be others now. */
  forget() {
    this.places = new WeakMap();
  }

  /** Places of the last seconds of a run, { time, answers, rows, at }; find: (row, outputs). */
  placesOf({ time, answers, rows, at }, find) {
    const found = [];
    for (let k = at; k >= 0 && time[k] > time[at] - SECONDS; k -= 1) {
      const answer = answers[k];
      if (!this.places.has(answer)) {
        this.places.set(answer, find(rows[k], answer.outputs));
      }
      found.push(this.places.get(answer));
    }
    return found.reverse();
  }

  draw(context, places, paint, width) {
    context.strokeStyle = paint;
    context.lineWidth = width;
    const size = (places.length - 1) / PARTS;
    for (let part = 0; part < PARTS && size > 0; part += 1) {
      const [from, to] = [Math.floor(part * size), Math.floor((part + 1) * size)];
      if (to > from) {
        context.globalAlpha = (part + 1) / PARTS;
        context.beginPath();
        places.slice(from, to + 1).forEach(([x, y]) => context.lineTo(x, y));
        context.stroke();
      }
    }
    context.globalAlpha = 1;
  }
}
