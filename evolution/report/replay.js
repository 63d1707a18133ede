/* Replays: draws recorded runs on their maps. One clock drives all boards of the chosen map set. */
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

  const WIDTH = 640;
  const byId = (id) => document.getElementById(id);
  const play = byId("play"), scrub = byId("scrub"), clock = byId("clock");
  const speed = byId("speed"), view = byId("view"), group = byId("group");
  /* A later line is thinner and has gaps, so that one that lies below it can be seen. */
  const LINES = ["solid", "dashed", "dotted"];
  const DASHES = [[], [16, 10], [4, 7]];
  const WIDTHS = [7, 4.5, 3.5];
  const lineOf = (name) => data.controllers.indexOf(name) % LINES.length;
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  /* Black, the last colour of the palette, is the ink of the page, so that it is seen on dark paper, too. */
  const isInk = (name) => data.colours[name] === "#000000";
  const colour = (name) => isInk(name) ? css("--ink") : data.colours[name] || "#888888";
  let now = 0;
  let end = 1;
  let playing = false;
  let last = 0;
  let panels = [];

  function legend() {
    data.controllers.forEach((name) => {
      const item = document.createElement("span");
      item.append(sample(name), name);
      byId("legend").append(item);
    });
    if (data.maps.some((map) => map.bodies)) {
      const item = document.createElement("span"), disc = document.createElement("i");
      disc.className = "disc";
      disc.style.background = data.people;
      item.append(disc, "people");
      byId("legend").append(item);
    }
    data.groups.forEach((name, index) => group.add(new Option(name, String(index))));
    byId("group-label").hidden = data.groups.length < 2;
  }

  function sample(name) {
    const line = document.createElement("i");
    line.style.borderTop = "3px " + LINES[lineOf(name)] + " " + (isInk(name) ? "var(--ink)" : colour(name));
    return line;
  }

  function layout() {
    const shown = data.maps.filter((map) => map.group === data.groups[Number(group.value) || 0]);
    boards.textContent = "";
    panels = [];
    shown.forEach((map) => {
      const groups = view.value === "side" ? map.runs.map((run) => [run]) : [map.runs];
      groups.forEach((runs) => panels.push(panel(map, runs)));
    });
    end = Math.max(1, ...shown.flatMap((map) => map.runs.map((run) => run.time)));
    scrub.max = end.toFixed(1);
    paint();
  }

  function panel(map, runs) {
    const board = document.createElement("article");
    board.className = "board";
    const title = document.createElement("h3");
    title.textContent = map.title + (view.value === "side" ? ": " + runs[0].controller : "");
    const canvas = document.createElement("canvas");
    canvas.width = WIDTH;
    canvas.height = Math.round(WIDTH * map.height / map.width);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", map.title + ", replay of " + runs.map((run) => run.controller).join(", "));
    const list = document.createElement("ul");
    runs.forEach((run) => list.append(summary(run)));
    const sample = document.createElement("p");
    sample.className = "hint";
    sample.textContent = map.sample;
    board.append(title, sample, canvas, list);
    boards.append(board);
    return { map, runs, canvas, scale: WIDTH / map.width, walls: document.createElement("canvas") };
  }

  function summary(run) {
    const item = document.createElement("li");
    const stuck = run.stuck.reduce((sum, spot) => sum + spot[3] - spot[2], 0);
    item.append(sample(run.controller), run.controller + ": " + run.outcome + " after " + run.time.toFixed(1) + " s" +
      (run.recoveries ? ", " + run.recoveries + (run.recoveries > 1 ? " recoveries" : " recovery") : "") +
      (stuck ? ", on the spot for " + stuck.toFixed(0) + " s" : ""));
    return item;
  }

  /* Walls, start and goal do not change: they are drawn once, in the current colours of the page. */
  function paint() {
    panels.forEach((panel) => {
      const { map, scale, walls, canvas } = panel;
      walls.width = canvas.width;
      walls.height = canvas.height;
      const pen = walls.getContext("2d");
      const side = map.resolution * scale;
      pen.fillStyle = css("--wall");
      map.walls.forEach(([col, row, cols, rows]) => {
        const left = Math.floor(col * side), top = Math.floor(walls.height - (row + rows) * side);
        const right = Math.ceil((col + cols) * side), bottom = Math.ceil(walls.height - row * side);
        pen.fillRect(left, top, right - left, bottom - top);  // whole pixels: no seams between rectangles
      });
      pen.strokeStyle = css("--soft");
      pen.lineWidth = 2;
      const [startX, startY] = place(panel, map.start[0], map.start[1]);
      const [goalX, goalY] = place(panel, map.goal[0], map.goal[1]);
      ring(pen, startX, startY, 6);
      pen.strokeRect(goalX - 7, goalY - 7, 14, 14);
    });
    draw();
  }

  function place(panel, x, y) {
    return [(x - panel.map.x) * panel.scale, panel.canvas.height - (y - panel.map.y) * panel.scale];
  }

  function draw() {
    panels.forEach((panel) => {
      const pen = panel.canvas.getContext("2d");
      pen.clearRect(0, 0, panel.canvas.width, panel.canvas.height);
      pen.drawImage(panel.walls, 0, 0);
      (panel.map.bodies || []).forEach((body) => drawBody(pen, panel, body));
      panel.runs.forEach((run) => drawRun(pen, panel, run));
    });
    clock.textContent = now.toFixed(1) + " s";
    scrub.value = now;
  }

  function ring(pen, x, y, radius) {
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  /* Where a body was: the same in all runs, as nothing stops a body. */
  function drawBody(pen, panel, body) {
    const index = Math.min(body.x.length - 1, Math.round(now / panel.map.period));
    const [x, y] = place(panel, body.x[index], body.y[index]);
    pen.fillStyle = data.people;
    pen.beginPath();
    pen.arc(x, y, body.radius * panel.scale, 0, 2 * Math.PI);
    pen.fill();
  }

  function drawRun(pen, panel, run) {
    const index = Math.min(run.x.length - 1, Math.round(now / run.period));
    pen.strokeStyle = colour(run.controller);
    pen.lineWidth = WIDTHS[lineOf(run.controller)];
    pen.beginPath();
    for (let i = 0; i <= index; i += 1) { pen.lineTo(...place(panel, run.x[i], run.y[i])); }
    pen.globalAlpha = 0.9;
    pen.setLineDash(DASHES[lineOf(run.controller)]);
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    pen.lineWidth = 2;
    run.stuck.filter((spot) => spot[2] <= now).forEach((spot) => drawStuck(pen, panel, spot));
    run.marks.filter((mark) => mark.time <= now).forEach((mark) => drawMark(pen, panel, mark));
    drawRobot(pen, panel, run, index);
  }

  function drawStuck(pen, panel, spot) {
    const [x, y] = place(panel, spot[0], spot[1]);
    const seconds = Math.min(now, spot[3]) - spot[2];
    pen.setLineDash([3, 4]);
    ring(pen, x, y, 8 + 3 * Math.sqrt(Math.max(0, seconds)));
    pen.setLineDash([]);
  }

  function drawMark(pen, panel, mark) {
    const [x, y] = place(panel, mark.x, mark.y);
    if (mark.kind === "contact") { pen.strokeRect(x - 5, y - 5, 10, 10); return; }
    pen.beginPath();
    pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5);
    pen.moveTo(x - 5, y + 5); pen.lineTo(x + 5, y - 5);
    pen.stroke();
  }

  function drawRobot(pen, panel, run, index) {
    const [x, y] = place(panel, run.x[index], run.y[index]);
    const corners = Array.isArray(run.robot) ? run.robot : null;
    const front = corners ? Math.max(...corners.map((corner) => corner[0])) : run.robot;
    pen.save();
    pen.translate(x, y);
    pen.rotate(-run.yaw[index]);
    pen.globalAlpha = 0.45;
    pen.fillStyle = colour(run.controller);
    pen.beginPath();
    if (corners) {
      for (const [ahead, left] of corners) { pen.lineTo(ahead * panel.scale, -left * panel.scale); }
    } else {
      pen.arc(0, 0, front * panel.scale, 0, 2 * Math.PI);
    }
    pen.fill();
    pen.globalAlpha = 1;
    pen.beginPath();
    pen.moveTo(0, 0);
    pen.lineTo(front * panel.scale, 0);
    pen.stroke();
    pen.restore();
  }

  function setPlaying(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
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

  play.addEventListener("click", () => setPlaying(!playing));
  scrub.addEventListener("input", () => seek(Number(scrub.value)));
  view.addEventListener("change", layout);
  group.addEventListener("change", () => { setPlaying(false); layout(); seek(end); });
  /* A key is meant for the replay if no other control has the focus and the replay is in view. */
  function isMeant(event) {
    const section = byId("maps"), place = section.getBoundingClientRect();
    if (event.defaultPrevented || event.altKey || event.ctrlKey || event.metaKey) { return false; }
    if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName)) { return false; }
    if (event.target !== document.body && !section.contains(event.target)) { return false; }
    return place.top < window.innerHeight && place.bottom > 0;
  }

  const keys = {
    " ": () => setPlaying(!playing),
    ArrowRight: () => seek(now + 0.5),
    ArrowLeft: () => seek(now - 0.5),
  };
  document.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || !isMeant(event)) { return; }
    event.preventDefault();
    keys[event.key]();
  });
  ["(prefers-color-scheme: dark)", "print"].forEach((medium) => {
    window.matchMedia(medium).addEventListener("change", paint);
  });
  legend();
  layout();
  seek(end);
}());
