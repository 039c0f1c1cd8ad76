// Elements of HTML, made in one line.

/** Makes an element with attributes; text and other elements go into it. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) {
      made.setAttribute(name, "");
    } else if (value !== false && value !== null) {
      made.setAttribute(name, value);
    }
  }
  made.append(...children);
  return made;
}

/** The element of the page with an id. */
export function byId(id) {
  const found = document.getElementById(id);
  if (found === null) {
    throw new Error(`the page has no element ${id}; expected one`);
  }
  return found;
}

/** Writes a text into an element, where it is another one: the page is then laid out anew. */
export function write(place, text) {
  if (place.textContent !== text) {
    place.textContent = text;
  }
}
