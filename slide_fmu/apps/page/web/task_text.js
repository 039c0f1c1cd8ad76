// The task of a move as a file for `slide-fmu motion`.

const RADIANS = Math.PI / 180;

/** A task as TOML; angles are in degrees here, and in rad there. */
export function taskText(facts, { channels, start, ways, tolerance, limits, parameters }) {
  const scales = channels.map(({ turns }) => (turns ? RADIANS : 1));
  const list = (values) => `[${values.map((value, i) => Number((value * scales[i]).toPrecision(9))).join(", ")}]`;
  const lines = [
    'kind = "choose"',
    `start = ${list(start)}`,
    `goal = ${list(start.map((value, i) => value + ways[i]))}`,
    `tolerance = ${tolerance}`,
    "candidates = 1000",
  ];
  if (limits.every((limit) => limit !== null)) {
    lines.push("", "[limits]", `speed = ${list(limits.map(({ speed }) => speed))}`);
    lines.push(`acceleration = ${list(limits.map(({ acceleration }) => acceleration))}`);
  }
  if (parameters.length > 0) {
    lines.push("", "[parameters]");
    lines.push(...facts.parameters.map(({ name }, i) => `${name} = ${parameters[i]}`));
  }
  return `${lines.join("\n")}\n`;
}
