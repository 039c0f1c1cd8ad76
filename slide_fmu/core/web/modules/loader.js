// Runs the script that a page holds compressed, and says where it cannot.

import { unpackText } from "./blobs.js";
import { byId, element } from "./elements.js";

unpackText("script").then(
  (text) => document.head.append(element("script", { type: "module" }, text)),
  (error) => {
    byId("problem").textContent = `The page cannot run here: ${error.message}`;
    byId("problem").hidden = false;
    document.documentElement.dataset.ready = "no";
  },
);
