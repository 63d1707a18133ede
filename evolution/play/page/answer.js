/* Answer: the table, who is better, why runs failed, and the command that repeats them. */

const byId = (id) => document.getElementById(id);
/* Soft hyphens break the headings where the table is narrow. */
const COLUMNS = [
  ["", (row) => row.variant], ["at the goal", (row) => share(row)], ["time, s", (row) => times(row)], ["length, m", (row) => number(row.length, 2)],
  ["clear\u00adance, m", (row) => number(row.clearance, 3)], ["recov\u00aderies", (row) => number(row.recoveries, row.runs > 1 ? 1 : 0)],
];

export class AnswerBox {
  constructor(store) { this.store = store; }

  begin() {
    byId("answer").setAttribute("aria-busy", "true");
  }

  /* Shows nothing in place of an answer that will not come: what is there is of another map or of other parameters. */
  fail() {
    if (byId("answer").getAttribute("aria-busy") !== "true") return;
    byId("answer").setAttribute("aria-busy", "false");
    for (const name of ["verdict", "table", "command"]) byId(name).replaceChildren();
  }

  show(answer, failures) {
    byId("answer").setAttribute("aria-busy", "false");
    this.sentences(answer, failures);
    this.table(answer.table);
    byId("command").textContent = answer.command.join("\n");
  }

  sentences(answer, failures) {
    const lines = answer.verdict.map((text) => paragraph(text));
    if (answer.gini !== null) lines.push(paragraph(`Gini coefficient of this map: ${answer.gini.toFixed(3)}.`));
    const first = new Map();
    for (const one of failures) if (!first.has(one.variant)) first.set(one.variant, one);
    for (const one of first.values()) lines.push(paragraph(`${one.variant}: ${one.sentence || one.outcome}`, "why"));
    byId("verdict").replaceChildren(...lines);
  }

  table(rows) {
    const head = document.createElement("tr");
    head.append(...COLUMNS.map(([title]) => cell("th", title)));
    byId("table").replaceChildren(head, ...rows.map((row) => this.row(row)));
  }

  row(row) {
    const line = document.createElement("tr");
    line.append(...COLUMNS.map(([, value]) => cell("td", value(row))));
    line.firstChild.prepend(sample(this.store.look(row.variant)));
    return line;
  }
}

/* A short line in the colour of a variant. */
export function sample({ colour, line }) {
  const shown = document.createElement("span");
  shown.className = `line ${line}`;
  shown.style.borderTopColor = colour;
  return shown;
}

export function paragraph(text, kind = "") {
  const shown = document.createElement("p");
  shown.textContent = text;
  shown.className = kind;
  return shown;
}

function cell(kind, text) {
  const shown = document.createElement(kind);
  shown.append(text);
  return shown;
}

function share(row) {
  const goal = Math.round((row.outcomes.goal || 0) * row.runs);
  if (row.runs > 1) return `${goal} of ${row.runs}`;
  return goal ? "yes" : Object.keys(row.outcomes)[0].replaceAll("_", " ");
}

function times(row) {
  if (row.time === null) return "–";
  return row.runs > 1 ? `${row.time.toFixed(2)} (${row.time_from.toFixed(1)} to ${row.time_to.toFixed(1)})` : row.time.toFixed(2);
}

function number(value, digits) { return value === null ? "–" : value.toFixed(digits); }
