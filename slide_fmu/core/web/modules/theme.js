// Dark or light: as the system says, until people switch, here or in a page that frames this one.

import { byId } from "./elements.js";

const DARK = "(prefers-color-scheme: dark)";

/** Makes the switch work; `changed` is called when colours change. */
export function beginTheme(changed) {
  const root = document.documentElement;
  const button = byId("theme");
  const system = window.matchMedia(DARK);
  const isDark = () => (root.dataset.theme ?? (system.matches ? "dark" : "light")) === "dark";
  const show = () => {
    button.setAttribute("aria-pressed", String(isDark()));
    changed();
  };
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
  show();
}
