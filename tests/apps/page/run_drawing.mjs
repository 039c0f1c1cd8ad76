// Finds the places of a drawing, and what of the plane it shows, without a browser.
//
// task, a JSON file: { drawing, facts, cases: [{ row, outputs, parameters, magnification }] }.

import { readFileSync } from "node:fs";
import { Drawing } from "../../../slide_fmu/apps/page/web/drawing.js";

const { drawing: description, facts, cases } = JSON.parse(readFileSync(process.argv[2], "utf-8"));
const drawing = new Drawing(description, facts, { style: {} });
const found = cases.map(({ row, outputs, parameters, magnification }) => {
  drawing.magnify(magnification);
  const places = drawing.places(row, outputs, parameters);
  return { places, view: drawing.viewOf(places) };
});
console.log(JSON.stringify(found));
