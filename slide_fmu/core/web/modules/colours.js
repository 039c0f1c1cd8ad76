// Colours by their names in the style sheet, which is asked once for each look of the page.

let [system, look, found] = [null, null, new Map()];

/** The colour that the style sheet gives to a name. */
export function colourOf(name) {
  system ??= window.matchMedia("(prefers-color-scheme: dark)");
  const now = document.documentElement.dataset.theme ?? system.matches;
  if (now !== look) {
    [look, found] = [now, new Map()];
  }
  if (!found.has(name)) {
    const style = getComputedStyle(document.documentElement);
    found.set(name, style.getPropertyValue(`--${name}`).trim());
  }
  return found.get(name);
}
