// Dark or light: as the system says, until people switch, here or in a page that frames this one.

import { byId } from "./elements.js";

const DARK = "(prefers-color-scheme: dark)";

const watching = [];

/** Makes the switch work; `changed` is called when colours change. Later calls add another one. */
export function beginTheme(changed) {
  watching.push(changed);
  const root = document.documentElement;
  const button = byId("theme");
  const system = window.matchMedia(DARK);
  const isDark = () => (root.dataset.theme ?? (system.matches ? "dark" : "light")) === "dark";
  const show = () => {
    button.setAttribute("aria-pressed", String(isDark()));
    watching.forEach((each) => each());
  };
  show();
  if (watching.length > 1) {
    return;
  }
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    show();
  });
  window.addEventListener("message", ({ data }) => {
    if (data?.theme === "dark" || data?.theme === "light") {
      root.dataset.theme = data.theme;
      show();
    }
  });
  system.addEventListener("change", show);
}
