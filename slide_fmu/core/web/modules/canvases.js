// Canvases of a page in motion: their sizes are kept, so that no frame has to lay the page out.

const kept = new WeakMap();

/**
 * Keeps the size of a canvas, and whether it is on the screen; `changed` is called when it is drawn
 * too small, too large, or too late.
 */
export function keepCanvas(canvas, changed) {
  const state = { width: canvas.clientWidth, height: canvas.clientHeight, seen: true };
  kept.set(canvas, state);
  new ResizeObserver(([{ contentRect }]) => {
    const [width, height] = [Math.round(contentRect.width), Math.round(contentRect.height)];
    if (width !== state.width || height !== state.height) {
      Object.assign(state, { width, height });
      changed();
    }
  }).observe(canvas);
  new IntersectionObserver(
    (entries) => {
      const seen = entries.at(-1).isIntersecting;
      if (seen && !state.seen) {
        changed();
      }
      state.seen = seen;
    },
    { rootMargin: "150px" },
  ).observe(canvas);
}

/** Whether it is worth while to draw on a canvas. */
export function isSeen(canvas) {
  const state = kept.get(canvas);
  return state === undefined || (state.seen && state.width > 0);
}

/** Makes the canvas as sharp as the screen; its context, in CSS pixels, and its size. */
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { width, height } = kept.get(canvas) ?? { width: canvas.clientWidth, height: canvas.clientHeight };
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
