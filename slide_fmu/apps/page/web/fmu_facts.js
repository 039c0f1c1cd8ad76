// The facts about a surrogate from the model description of its FMU, FMI 2.0 or 3.0.
// Kinds of variables are numbers of slide_fmu/fmu/description/variables.py.

const PER_KIND = 1000000;
const [INPUT, OUTPUT, ESTIMATE, AT_STEP_END, PARAMETER] = [0, 1, 2, 12, 13];
const [BOUND, CONFIDENCE, HELD] = [15, 19, 23];
const FLAGS = [3, 4, 6, 16, 17, 18, 22];

/** Variables as { name, description, kind, reference, unit, low, high, start }, in their order. */
function variablesOf(document) {
  const list = document.getElementsByTagName("ModelVariables")[0]?.children ?? [];
  return Array.from(list, (element) => {
    // FMI 2.0 has the type within the variable, FMI 3.0 as its name
    const type = element.tagName === "ScalarVariable" ? element.children[0] : element;
    const number = (name) => Number(type.getAttribute(name) ?? NaN);
    const reference = Number(element.getAttribute("valueReference"));
    return {
      name: element.getAttribute("name"),
      description: element.getAttribute("description") ?? "",
      kind: Math.floor(reference / PER_KIND),
      reference,
      unit: type.getAttribute("unit") ?? "1",
      low: number("min"),
      high: number("max"),
      start: number("start"),
    };
  });
}

/** Inputs that are cosine and sine of one angle say so; their ranges are the same. */
function withAngles(inputs) {
  const kindOf = (input) => /^(cosine|sine) of /.exec(input?.description ?? "")?.[1] ?? null;
  return inputs.map((input, i) => {
    const kind = kindOf(input);
    const other = kind === "cosine" ? inputs[i + 1] : inputs[i - 1];
    const pair = kind !== null && other?.high === input.high && input.low === -input.high;
    const angle = pair && [kind, kindOf(other)].sort().join() === "cosine,sine" ? kind : null;
    return { ...input, angle };
  });
}

/** The least and the largest value of each output in a table of results, or what it has alone. */
function rangeOfOutput({ name, unit }, table) {
  const column = table?.columns[table.names.indexOf(name)];
  if (column === undefined) {
    return unit === "1" ? [-1, 1] : [-1e-3, 1e-3];
  }
  const size = column.reduce((most, value) => Math.max(most, Math.abs(value)), 1e-12);
  return [-1.5 * size, 1.5 * size];
}

/** The facts of a page (slide_fmu/apps/page/facts.py); results: the stored trajectory, or null. */
export function factsOfFmu(text, results) {
  const document = new DOMParser().parseFromString(text, "application/xml");
  const root = document.documentElement;
  const step = Number(document.getElementsByTagName("DefaultExperiment")[0]?.getAttribute("stepSize"));
  const all = variablesOf(document);
  const of = (kind) => all.filter((variable) => variable.kind === kind);
  if (!(root.getAttribute("generationTool") ?? "").startsWith("slide-fmu") || !(step > 0)) {
    throw new Error("its model description is not by slide-fmu");
  }
  const said = (kind, name) => of(kind).find((variable) => variable.name === name)?.reference ?? null;
  const [confidence] = of(CONFIDENCE);
  const samples = Number(/last (\d+) samples/.exec(root.getAttribute("description") ?? "")?.[1] ?? 1);
  const [estimate] = of(ESTIMATE);
  const estimated = Number(/last (\d+) samples/.exec(estimate?.description ?? "")?.[1] ?? NaN);
  return {
    name: root.getAttribute("modelName"),
    step,
    hold: of(AT_STEP_END).length > 0 ? "first_order" : "zero_order",
    memory: step * samples,
    past: step * Math.max(samples, Number.isFinite(estimated) ? estimated : 0),
    estimated: estimate === undefined ? null : step * estimated,
    inputs: withAngles(of(INPUT)),
    outputs: of(OUTPUT).map((output) => {
      const [low, high] = rangeOfOutput(output, results);
      const estimateOf = said(ESTIMATE, `${output.name}_error_estimate`);
      const boundOf = said(BOUND, `${output.name}_error_bound`);
      return { ...output, low, high, estimate: estimateOf, bound: boundOf };
    }),
    parameters: of(PARAMETER),
    flags: Object.fromEntries(
      all.filter(({ kind }) => FLAGS.includes(kind)).map(({ name, reference }) => [name, reference]),
    ),
    confidence: confidence ?? null,
    known: [...of(AT_STEP_END), ...of(HELD)][0]?.reference ?? null,
  };
}

/** Values of parameters, by name, from a file of SSV. */
export function parametersOf(text) {
  const document = new DOMParser().parseFromString(text, "application/xml");
  const found = Array.from(document.getElementsByTagNameNS("*", "Parameter"));
  return Object.fromEntries(
    found.map((element) => [element.getAttribute("name"), Number(element.children[0].getAttribute("value"))]),
  );
}
