// The buttons of a page: what is shown, play and pause, wander and pace.

import { byId } from "../../../core/web/modules/elements.js";

/** What a page can show. */
export const WAYS = ["live", "moves", "stored", "own"];

/** Lets people press buttons and keys of an app. */
export function watchButtons(app) {
  const on = (id, event, action) => byId(id).addEventListener(event, action);
  WAYS.forEach((way) => on(`way-${way}`, "click", () => app.choose(way)));
  byId("way-stored").hidden = app.courses.stored === undefined;
  byId("way-moves").hidden = !app.optimiser.possible;
  on("play", "click", () => app.play(!app.playing));
  on("restart", "click", () => app.restart());
  on("wander", "change", () => app.wander(byId("wander").checked));
  on("pace", "change", () => {
    app.live.pace = Number(byId("pace").value);
  });
  on("time", "input", () => app.point(Number(byId("time").value)));
  document.addEventListener("keydown", (event) => {
    if (event.key === " " && event.target === document.body) {
      event.preventDefault();
      app.play(!app.playing);
    }
  });
}
