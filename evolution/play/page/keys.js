/* Keys: everything by the keyboard. */

const byId = (id) => document.getElementById(id);
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FAR = 5;
const TURN = Math.PI / 12;

export function listen(tools, timeline, search, parameters) {
  const others = [
    ["s", "Start here", () => tools.place("start")], ["g", "Goal here", () => tools.place("goal")],
    ["t", "Turn the start by 15°", () => tools.turn("start", TURN)], ["u", "Turn the goal by 15°", () => tools.turn("goal", TURN)],
    ["+", "Closer", () => tools.view.zoomBy(1.2)], ["-", "Farther", () => tools.view.zoomBy(1 / 1.2)],
    ["0", "Show the whole map", () => tools.view.fit()], [" ", "Play or pause", () => timeline.toggle()],
    [",", "0.5 s back", () => timeline.by(-0.5)], [".", "0.5 s on", () => timeline.by(0.5)],
    ["h", "Make it harder", () => byId("harder").click()], ["a", "Tell them apart", () => byId("apart").click()],
    ["w", "Why?", () => byId("why").click()], ["m", "Go to the map", () => byId("map").focus()],
    ["/", "Search a parameter", () => byId("parameter-search").focus()], ["k", "Compare", () => parameters.compare()],
    ["Delete", "Remove all walls", () => tools.clear()], ["?", "These keys", () => byId("help").showModal()],
  ];
  explain([...tools.keys(), ...others.map(([key, title]) => [key, title])]);
  byId("help-open").addEventListener("click", () => byId("help").showModal());
  document.addEventListener("keydown", (event) => {
    if (act(event, tools, others)) event.preventDefault();
  });
}

function act(event, tools, others) {
  if (event.target.closest("input, select, textarea, dialog[open]")) return false;
  if (event.ctrlKey || event.metaKey) return travel(event, tools);
  if (event.altKey) return false;
  if (event.target.id === "map" && onMap(event, tools)) return true;
  if (event.key === " " && event.target.closest("button, summary, label")) return false;
  const found = others.find(([key]) => key === event.key);
  if (found) found[2]();
  return Boolean(found) || tools.chooseByKey(event.key);
}

function travel(event, tools) {
  const redo = event.key === "y" || (event.key.toLowerCase() === "z" && event.shiftKey);
  if (!redo && event.key !== "z") return false;
  tools.travel(redo ? "redo" : "undo");
  return true;
}

function onMap(event, tools) {
  if (event.key in ARROWS) {
    const far = event.shiftKey ? FAR : 1;
    tools.step(...ARROWS[event.key].map((one) => one * far));
    return true;
  }
  if (event.key !== "Enter") return false;
  tools.enter();
  return true;
}

function explain(keys) {
  const all = [...keys, ["Ctrl+Z", "Undo"], ["Ctrl+Y", "Redo"], ["arrows", "Move the cursor on the map (with Shift: 5 cells), or the map with the tool Move"], ["Enter", "Draw at the cursor; shapes: begin and end"]];
  byId("help-list").replaceChildren(...all.map(([key, title]) => {
    const line = document.createElement("p"), shown = document.createElement("kbd");
    shown.textContent = key === " " ? "space" : key;
    line.append(shown, ` ${title}`);
    return line;
  }));
}
