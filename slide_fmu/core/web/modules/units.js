// Numbers for people: prefixes of units, and ticks of axes.

const PREFIXES = [
  [1e-9, "n"],
  [1e-6, "µ"],
  [1e-3, "m"],
  [1, ""],
  [1e3, "k"],
  [1e6, "M"],
];
const PREFIXED = new Set(["m", "N", "s", "Pa", "V", "A", "W", "J", "Hz", "rad"]);

/** How values up to a size are shown in their unit: { factor, unit }, shown is value / factor. */
export function scaleFor(largest, unit) {
  if (!PREFIXED.has(unit) || !(largest > 0)) {
    return { factor: 1, unit: unit === "1" ? "" : unit };
  }
  const fitting = PREFIXES.filter(([factor]) => largest >= 0.9 * factor);
  const [factor, prefix] = fitting.at(-1) ?? PREFIXES[0];
  return { factor, unit: prefix + unit };
}

/** A number with so many digits, without an exponent where it is short. */
export function digits(value, count = 3) {
  if (!Number.isFinite(value)) {
    return "–";
  }
  const text = value.toPrecision(count);
  const short = text.includes("e") && Math.abs(value) >= 1e-4 && Math.abs(value) < 1e6;
  return (short ? String(Number(text)) : text).replace("-", "−");
}

/** The place of a tick with its own prefix, such as "10 µm"; null where the unit has none. */
export function placeText(value, unit) {
  const scale = scaleFor(value, unit);
  return PREFIXED.has(unit) ? `${Number((value / scale.factor).toPrecision(3))} ${scale.unit}` : null;
}

/** A value with its unit, as one that belongs to values of a size. */
export function quantity(value, largest, unit, count = 3) {
  const scale = scaleFor(largest, unit);
  return `${digits(value / scale.factor, count)} ${scale.unit}`.trim();
}

/** Round numbers from low to high, about so many: { values, decimals }. */
export function ticksOf(low, high, about) {
  const raw = (high - low) / Math.max(about, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= 0.999 * raw);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  return {
    values: Array.from({ length: count }, (_, i) => (first + i) * step),
    decimals: Math.max(0, -Math.floor(Math.log10(step * 1.001))),
  };
}
