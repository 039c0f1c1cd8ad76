// Signals over time as CSV: a column `time` in s, then one for each variable.

const TIME = "time";

/** Reads a table: { names, time, columns }, the last two Float64Arrays. */
export function readTable(text, name) {
  const lines = text.replace(/^\ufeff/, "").split(/\r?\n/).filter((line) => line.trim() !== "");
  const separator = (lines[0] ?? "").includes(";") ? ";" : ",";
  const names = (lines[0] ?? "").split(separator).map((cell) => cell.trim().replace(/^"|"$/g, ""));
  if (names[0] !== TIME || lines.length < 3) {
    throw new Error(
      `${name} begins with ${JSON.stringify((lines[0] ?? "").slice(0, 60))} and has ` +
        `${lines.length} lines; expected names of columns, "${TIME}" first, and at least two rows`,
    );
  }
  const rows = lines.slice(1).map((line, k) => numbersOf(line, separator, names, name, k + 2));
  const [time, ...columns] = names.map((_, i) => Float64Array.from(rows, (row) => row[i]));
  const back = time.findIndex((t, k) => k > 0 && !(t > time[k - 1]));
  if (back > 0) {
    throw new Error(`${name}, line ${back + 2}: time ${time[back]}; expected rising times`);
  }
  return { names: names.slice(1), time, columns };
}

function numbersOf(line, separator, names, name, number) {
  const cells = line.split(separator);
  if (cells.length !== names.length) {
    throw new Error(
      `${name}, line ${number} has ${cells.length} values; expected ${names.length}, one for ` +
        "each column",
    );
  }
  return cells.map((cell) => {
    const value = cell.trim() === "" ? NaN : Number(cell);
    if (!Number.isFinite(value)) {
      throw new Error(`${name}, line ${number}: "${cell.trim()}"; expected a number`);
    }
    return value;
  });
}

/** The columns with some names, in their order. */
export function pickColumns(table, wanted, name) {
  return wanted.map((column) => {
    const index = table.names.indexOf(column);
    if (index < 0) {
      throw new Error(
        `${name} has the columns ${table.names.join(", ")}; expected ${wanted.join(", ")}: ` +
          `${column} is missing`,
      );
    }
    return table.columns[index];
  });
}

/** Writes a table; values have nine digits, times all of theirs. */
export function writeTable(names, time, columns) {
  const rows = Array.from(time, (t, k) =>
    [String(t), ...columns.map((column) => String(Number(column[k].toPrecision(9))))].join(","),
  );
  return [[TIME, ...names].join(","), ...rows, ""].join("\n");
}
