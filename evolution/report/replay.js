/* Replays: draws recorded runs on their maps. One clock drives all boards. */
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("replays").textContent);
  const boards = document.getElementById("boards");
  const zoom = document.querySelectorAll(".zoom");
  if (zoom.length && window.mediumZoom) {
    const zoomed = window.mediumZoom(zoom, { margin: 24, background: "#ffffff" });
    zoom.forEach((image) => image.addEventListener("keydown", (event) => {
      if (event.key === "Enter") { zoomed.open({ target: image }); }
    }));
  }
  if (!boards || !data.maps.length) { return; }

  const play = document.getElementById("play");
  const scrub = document.getElementById("scrub");
  const clock = document.getElementById("clock");
  const speed = document.getElementById("speed");
  const view = document.getElementById("view");
  const end = Math.max(1, ...data.maps.flatMap((map) => map.runs.map((run) => run.time)));
  const colour = (name) => data.colours[name] || "#888888";
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let now = end;
  let playing = false;
  let last = 0;
  let panels = [];

  document.getElementById("legend").innerHTML = "";
  data.controllers.forEach((name) => {
    const item = document.createElement("span");
    const dot = document.createElement("i");
    dot.style.background = colour(name);
    item.append(dot, name);
    document.getElementById("legend").append(item);
  });

  function layout() {
    boards.textContent = "";
    panels = [];
    data.maps.forEach((map) => {
      const groups = view.value === "side" ? map.runs.map((run) => [run]) : [map.runs];
      groups.forEach((runs) => panels.push(panel(map, runs)));
    });
    draw();
  }

  function panel(map, runs) {
    const board = document.createElement("article");
    board.className = "board";
    const title = document.createElement("h3");
    title.textContent = map.title + (view.value === "side" ? ": " + runs[0].controller : "");
    const canvas = document.createElement("canvas");
    canvas.width = 640;
    canvas.height = Math.round(640 * map.height / map.width);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", map.title + ", replay of " + runs.map((run) => run.controller).join(", "));
    const list = document.createElement("ul");
    runs.forEach((run) => {
      const item = document.createElement("li");
      item.textContent = run.controller + ": " + run.outcome + " after " + run.time.toFixed(1) + " s" +
        (run.recoveries ? ", " + run.recoveries + " recoveries" : "");
      list.append(item);
    });
    board.append(title, canvas, list);
    boards.append(board);
    return { map, runs, canvas, scale: canvas.width / map.width };
  }

  function draw() {
    panels.forEach(drawPanel);
    clock.textContent = now.toFixed(1) + " s";
    scrub.value = now;
  }

  function drawPanel(panel) {
    const { map, canvas, scale } = panel;
    const pen = canvas.getContext("2d");
    const px = (x) => (x - map.x) * scale;
    const py = (y) => canvas.height - (y - map.y) * scale;
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = css("--wall");
    map.walls.forEach(([col, row, cols, rows]) => {
      const side = map.resolution * scale;
      pen.fillRect(col * side, canvas.height - (row + rows) * side, cols * side, rows * side);
    });
    pen.strokeStyle = css("--soft");
    pen.lineWidth = 2;
    ring(pen, px(map.start[0]), py(map.start[1]), 6);
    pen.strokeRect(px(map.goal[0]) - 7, py(map.goal[1]) - 7, 14, 14);
    panel.runs.forEach((run) => drawRun(pen, map, run, px, py, scale));
  }

  function ring(pen, x, y, radius) {
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  function drawRun(pen, map, run, px, py, scale) {
    const index = Math.min(run.x.length - 1, Math.round(now / run.period));
    pen.strokeStyle = colour(run.controller);
    pen.lineWidth = 3;
    pen.beginPath();
    for (let i = 0; i <= index; i += 1) { pen.lineTo(px(run.x[i]), py(run.y[i])); }
    pen.stroke();
    pen.lineWidth = 2;
    run.marks.filter((mark) => mark.time <= now).forEach((mark) => {
      const x = px(mark.x), y = py(mark.y);
      if (mark.kind === "contact") { pen.strokeRect(x - 5, y - 5, 10, 10); return; }
      pen.beginPath();
      pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5);
      pen.moveTo(x - 5, y + 5); pen.lineTo(x + 5, y - 5);
      pen.stroke();
    });
    const x = px(run.x[index]), y = py(run.y[index]), radius = map.robot * scale;
    pen.globalAlpha = 0.45;
    pen.fillStyle = colour(run.controller);
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
    pen.globalAlpha = 1;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + radius * Math.cos(run.yaw[index]), y - radius * Math.sin(run.yaw[index]));
    pen.stroke();
  }

  function setPlaying(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(on));
    if (on) {
      if (now >= end) { now = 0; }
      last = performance.now();
      requestAnimationFrame(tick);
    }
  }

  function tick(moment) {
    if (!playing) { return; }
    now = Math.min(end, now + Math.max(0, moment - last) / 1000 * Number(speed.value));
    last = moment;
    draw();
    if (now >= end) { setPlaying(false); } else { requestAnimationFrame(tick); }
  }

  function seek(time) {
    now = Math.min(end, Math.max(0, time));
    draw();
  }

  scrub.max = end.toFixed(1);
  play.addEventListener("click", () => setPlaying(!playing));
  scrub.addEventListener("input", () => seek(Number(scrub.value)));
  view.addEventListener("change", layout);
  document.addEventListener("keydown", (event) => {
    if (/^(INPUT|SELECT|BUTTON|TH|A|SUMMARY)$/.test(event.target.tagName)) { return; }
    if (event.key === " ") { event.preventDefault(); setPlaying(!playing); }
    if (event.key === "ArrowRight") { seek(now + 0.5); }
    if (event.key === "ArrowLeft") { seek(now - 0.5); }
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  layout();
}());
