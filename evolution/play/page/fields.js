/* Fields: an input for a parameter of any kind, with its unit and range. */

export function field(parameter, value, onValue) {
  if (parameter.kind === "bool") return checkbox(value, onValue);
  if (parameter.choices.length) return choice(parameter.choices, value, onValue);
  return parameter.kind === "float" || parameter.kind === "int" ? numeric(parameter, value, onValue) : text(parameter, value, onValue);
}

function checkbox(value, onValue) {
  const input = document.createElement("input");
  input.type = "checkbox";
  input.checked = Boolean(value);
  input.addEventListener("change", () => onValue(input.checked));
  return input;
}

export function choice(choices, value, onValue) {
  const input = document.createElement("select");
  for (const one of choices) {
    const [name, label] = Array.isArray(one) ? one : [one, one];
    input.add(new Option(label, name, name === String(value), name === String(value)));
  }
  input.addEventListener("change", () => onValue(input.value));
  return input;
}

function numeric(parameter, value, onValue) {
  const input = document.createElement("input");
  let kept = value;
  input.type = "number";
  input.step = parameter.kind === "int" ? "1" : "any";
  input.value = String(value);
  input.addEventListener("change", () => {
    const given = Number(input.value);
    const usable = input.value.trim() !== "" && Number.isFinite(given) && (parameter.kind === "float" || Number.isInteger(given));
    if (usable) onValue(kept = given);
    else input.value = String(kept);
  });
  return input;
}

/* Lists are written as JSON. */
function text(parameter, value, onValue) {
  const input = document.createElement("input");
  input.type = "text";
  const isText = parameter.kind === "str";
  let kept = value;
  input.value = isText ? String(value) : JSON.stringify(value);
  input.addEventListener("change", () => {
    try {
      kept = isText ? input.value : JSON.parse(input.value);
    } catch {
      input.value = JSON.stringify(kept);
      return;
    }
    onValue(kept);
  });
  return input;
}

/* A row with name, input, and what is known of the parameter; onValue returns whether a value is a changed one. */
export function row(parameter, value, changed, onValue) {
  const shown = document.createElement("div"), label = document.createElement("label"), key = document.createElement("span");
  shown.className = changed ? "parameter changed" : "parameter";
  key.className = "key";
  key.textContent = parameter.key;
  label.append(key, field(parameter, value, (given) => shown.classList.toggle("changed", onValue(given))));
  const hint = document.createElement("p");
  hint.className = "hint";
  hint.textContent = words(parameter);
  shown.append(label, hint);
  return shown;
}

function words({ text: says, unit, low, high, default: own }) {
  const sentences = [says.replaceAll("``", "").replace(/[.;,]$/, ""), `Default ${JSON.stringify(own)}${unit && ` ${unit}`}`];
  if (low !== null && high !== null) sentences.push(`Range ${short(low)} to ${short(high)}`);
  return sentences.filter(Boolean).map((one) => `${one}.`).join(" ");
}

function short(value) { return Number(value.toPrecision(4)).toString(); }
