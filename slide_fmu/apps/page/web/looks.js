// How the machine is drawn: the factor on its deflection, and the trail of its tool.

import { byId, element } from "../../../core/web/modules/elements.js";

const FACTORS = [1, 5, 25, 100];

/** Lets people choose how a drawing looks; `changed` is called then. */
export function watchLooks(drawing, changed) {
  const { magnification, trail } = drawing.description;
  byId("magnify-label").hidden = magnification === undefined;
  byId("trail-label").hidden = trail === undefined;
  byId("look").hidden = magnification === undefined && trail === undefined;
  const factors = [...new Set([...FACTORS, magnification ?? 1])].sort((a, b) => a - b);
  byId("magnify").append(...factors.map((factor) => element("option", { value: factor }, `× ${factor}`)));
  byId("magnify").value = drawing.magnification;
  byId("magnify").addEventListener("change", () => {
    drawing.magnify(Number(byId("magnify").value));
    changed();
  });
  byId("trail").addEventListener("change", () => {
    drawing.trailing = byId("trail").checked;
    changed();
  });
}
