// Expressions of a drawing become functions once, so that a frame only calls them.

const OPERATIONS = {
  "+": (a, b) => (known) => a(known) + b(known),
  "-": (a, b) => (known) => a(known) - b(known),
  "*": (a, b) => (known) => a(known) * b(known),
  "/": (a, b) => (known) => a(known) / b(known),
  sqrt: (a) => (known) => Math.sqrt(Math.max(a(known), 0)),
  sin: (a) => (known) => Math.sin(a(known)),
  cos: (a) => (known) => Math.cos(a(known)),
};

/** Makes a function of the known values; places: where each name lies in them. */
function compile(expression, places) {
  if (typeof expression === "number") {
    return () => expression;
  }
  if (typeof expression === "string") {
    const place = places.get(expression);
    return (known) => known[place];
  }
  const [operation, ...parts] = expression;
  return OPERATIONS[operation](...parts.map((part) => compile(part, places)));
}

/** Makes the function that finds the points of a description: given values to [name, numbers]. */
export function compilePoints({ values = [], points }, names) {
  const places = new Map(names.map((name, i) => [name, i]));
  const later = values.map(([name, expression]) => {
    const find = compile(expression, places);
    places.set(name, places.size);
    return find;
  });
  const wanted = Object.entries(points).map(([name, coordinates]) => [
    name,
    coordinates.map((coordinate) => compile(coordinate, places)),
  ]);
  const known = new Float64Array(names.length + later.length);
  return (given) => {
    known.set(given);
    later.forEach((find, i) => {
      known[names.length + i] = find(known);
    });
    return wanted.map(([name, coordinates]) => [name, coordinates.map((find) => find(known))]);
  };
}
