// Files of people: a record of their own, and what they save.

import { saveText } from "../../../core/web/modules/blobs.js";
import { byId } from "../../../core/web/modules/elements.js";
import { ownCourse } from "./course.js";

/** Lets people open and save files in an app. */
export function watchFiles(app) {
  const on = (id, event, action) => byId(id).addEventListener(event, action);
  on("open", "change", () => open(app, byId("open").files[0]));
  on("drop", "dragover", (event) => event.preventDefault());
  on("drop", "drop", (event) => {
    event.preventDefault();
    open(app, event.dataTransfer.files[0]);
  });
  on("save", "click", () => saveText(`${app.facts.name}_answers.csv`, app.course.table(app.facts)));
  on("example", "click", () => saveText("inputs.csv", app.files.inputs));
  byId("example").hidden = app.courses.stored === undefined;
}

/** Takes a user's record, if the surrogate can answer it. */
async function open(app, file) {
  if (file === undefined) {
    return;
  }
  const text = await file.text();
  app.attempt(() => {
    const course = ownCourse(app.facts, text, file.name);
    app.answer(course);
    app.courses.own = course;
    app.choose("own");
  });
}
