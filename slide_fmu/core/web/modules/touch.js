// How people read and zoom a chart: pointer, fingers and keys.

const SHORTEST = 8;
const KEYS = { "+": 0.5, "=": 0.5, "-": 2 };

/** Lets people mark a place of a chart, and choose the part that they want to see. */
export function watchChart(chart, canvas) {
  let begin = null;
  const at = (event) => chart.placeOf(canvas, event.clientX);
  canvas.addEventListener("pointerdown", (event) => {
    begin = { clientX: event.clientX, place: at(event) };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (begin !== null && Math.abs(event.clientX - begin.clientX) > SHORTEST) {
      chart.select(inOrder(begin.place, at(event)));
    } else {
      chart.point(at(event));
    }
  });
  canvas.addEventListener("pointerup", () => {
    const { selection } = chart;
    begin = null;
    chart.select(null);
    if (selection !== null) {
      chart.zoom(selection);
    }
  });
  canvas.addEventListener("pointercancel", () => {
    begin = null;
    chart.select(null);
  });
  canvas.addEventListener("pointerleave", () => begin === null && chart.point(null));
  canvas.addEventListener("dblclick", () => chart.zoom(chart.whole));
  canvas.addEventListener("wheel", (event) => stretchByWheel(chart, event, at), { passive: false });
  canvas.addEventListener("keydown", (event) => press(chart, event));
  canvas.addEventListener("blur", () => chart.point(null));
}

function inOrder(one, other) {
  return one < other ? [one, other] : [other, one];
}

/** A wheel alone scrolls the page; with the control key, which pinching gives too, it zooms. */
function stretchByWheel(chart, event, at) {
  if (event.ctrlKey) {
    event.preventDefault();
    chart.stretch(Math.exp(0.01 * Math.max(-50, Math.min(50, event.deltaY))), at(event));
  }
}

function press(chart, event) {
  const [from, to] = chart.xRange;
  const way = { ArrowRight: 0.02, ArrowLeft: -0.02 }[event.key];
  const middle = chart.axis.log ? Math.sqrt(from * to) : (from + to) / 2;
  if (way !== undefined) {
    event.preventDefault();
    const step = chart.axis.log
      ? (place) => place * (to / from) ** way
      : (place) => place + way * (to - from);
    chart.point(Math.min(Math.max(step(chart.cursor ?? middle), from), to));
  } else if (event.key in KEYS) {
    chart.stretch(KEYS[event.key], chart.cursor ?? middle);
  } else if (event.key === "0" || event.key === "Escape") {
    chart.zoom(chart.whole);
  }
}
