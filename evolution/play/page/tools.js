/* Tools: what a stroke on the map does. */

const HANDLE = 0.35;
const RADII = [0, 1, 2, 4];

const TOOLS = [
  { name: "brush", key: "b", title: "Draw walls" },
  { name: "eraser", key: "e", title: "Erase walls" },
  { name: "wall", key: "l", title: "Straight wall" },
  { name: "rectangle", key: "r", title: "Rectangle" },
  { name: "circle", key: "c", title: "Circle: centre, then radius" },
  { name: "move", key: "v", title: "Move the map; the wheel zooms" },
];

export class Tools {
  constructor(place, view, store, onStroke) {
    this.view = view;
    this.store = store;
    this.onStroke = onStroke;
    this.tool = "brush";
    this.size = 1;
    this.cursor = null;
    this.stroke = null;
    this.buttons = {};
    this.build(place);
    this.listen(view.canvas);
    view.add((context) => this.draw(context));
  }

  build(place) {
    for (const tool of TOOLS) {
      const button = this.button(place, tool.name[0].toUpperCase() + tool.name.slice(1), `${tool.title} (${tool.key})`, () => this.choose(tool.name));
      this.buttons[tool.name] = button;
    }
    const size = document.createElement("select");
    size.setAttribute("aria-label", "Width of a stroke");
    RADII.forEach((radius) => size.add(new Option(`${2 * radius + 1} cells`, String(radius), radius === this.size, radius === this.size)));
    size.addEventListener("change", () => { this.size = Number(size.value); });
    place.append(size);
    this.button(place, "Undo", "Undo (Ctrl+Z)", () => this.travel("undo"));
    this.button(place, "Redo", "Redo (Ctrl+Y)", () => this.travel("redo"));
    this.button(place, "Clear", "Remove all walls (Delete)", () => this.clear());
    this.button(place, "Fit", "Show the whole map (0)", () => this.view.fit());
    this.choose(this.tool);
  }

  button(place, text, title, act) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.title = title;
    button.addEventListener("click", act);
    place.append(button);
    return button;
  }

  keys() { return TOOLS.map((tool) => [tool.key, tool.title]); }

  chooseByKey(key) {
    const found = TOOLS.find((tool) => tool.key === key);
    if (found) this.choose(found.name);
    return Boolean(found);
  }

  choose(name) {
    this.tool = name;
    for (const [one, button] of Object.entries(this.buttons)) button.setAttribute("aria-pressed", String(one === name));
  }

  travel(way) {
    this.store[way]();
    this.onStroke();
  }

  clear() {
    this.store.remember();
    this.store.grid.cells.fill(0);
    this.end();
  }

  listen(canvas) {
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.view.zoomAt(event, event.deltaY < 0 ? 1.2 : 1 / 1.2);
    }, { passive: false });
  }

  down(event) {
    const point = this.view.at(event);
    this.view.canvas.setPointerCapture(event.pointerId);
    const handle = this.handleAt(point);
    if (this.tool === "move" && !handle) {
      this.stroke = { kind: "move", last: [event.clientX, event.clientY] };
      return;
    }
    this.store.remember();
    if (handle) {
      this.stroke = { kind: "pose", ...handle };
      return;
    }
    const cell = this.store.grid.cellAt(...point);
    this.stroke = { kind: "draw", from: cell, last: cell, value: this.tool === "eraser" || event.button === 2 ? 0 : 1 };
    this.apply(cell);
  }

  move(event) {
    const point = this.view.at(event);
    this.cursor = point;
    if (this.stroke) this.drag(event, point);
    this.view.paint();
  }

  drag(event, point) {
    if (this.stroke.kind === "move") {
      const ratio = devicePixelRatio || 1, { last } = this.stroke;
      this.view.shift[0] += (event.clientX - last[0]) * ratio;
      this.view.shift[1] += (event.clientY - last[1]) * ratio;
      this.stroke.last = [event.clientX, event.clientY];
    } else if (this.stroke.kind === "pose") {
      this.movePose(point);
    } else {
      this.apply(this.store.grid.cellAt(...point));
    }
  }

  up() {
    const stroke = this.stroke;
    this.stroke = null;
    if (!stroke || stroke.kind === "move") return;
    if (stroke.kind === "draw") this.shape(this.store.grid, stroke);
    this.end();
  }

  end() {
    this.store.changed("map");
    this.onStroke();
  }

  /* Brush and eraser draw while the pointer moves; shapes when it is released. */
  apply(cell) {
    const { grid } = this.store, stroke = this.stroke;
    if (this.tool === "brush" || this.tool === "eraser") {
      grid.line(stroke.last, cell, this.size, stroke.value);
      this.store.changed("map");
    }
    stroke.last = cell;
  }

  shape(grid, { from, last, value }) {
    if (this.tool === "wall") grid.line(from, last, this.size, value);
    if (this.tool === "rectangle") grid.rectangle(from, last, value);
    if (this.tool === "circle") grid.circle(from, last, value);
  }

  /* Start and goal have two handles: the middle moves the pose, the tip turns it. */
  handleAt(point) {
    for (const which of ["start", "goal"]) {
      const [x, y] = this.store[which], tip = this.tip(which);
      if (Math.hypot(point[0] - tip[0], point[1] - tip[1]) < 0.5 * HANDLE) return { which, part: "tip" };
      if (Math.hypot(point[0] - x, point[1] - y) < HANDLE) return { which, part: "middle" };
    }
    return null;
  }

  tip(which) {
    const [x, y, yaw] = this.store[which];
    return [x + 2 * HANDLE * Math.cos(yaw), y + 2 * HANDLE * Math.sin(yaw)];
  }

  movePose(point) {
    const pose = this.store[this.stroke.which];
    if (this.stroke.part === "tip") pose[2] = Math.atan2(point[1] - pose[1], point[0] - pose[0]);
    else [pose[0], pose[1]] = point;
  }

  draw(context) {
    for (const [which, colour] of [["start", "#009E73"], ["goal", "#D55E00"]]) {
      this.view.robot(context, this.store[which], this.store.robot(), colour, true);
      this.view.line(context, [this.store[which].slice(0, 2), this.tip(which)], colour, 3);
      this.view.dot(context, this.tip(which), 5, colour);
      this.view.keepFree(this.store[which], 6);
      this.view.keepFree(this.tip(which), 5);
      this.view.label(which, this.store[which], 0, 16);
    }
    if (this.stroke && this.stroke.kind === "draw") this.preview(context);
    if (this.cursor && this.tool !== "move") this.ring(context);
  }

  /* The shape that a stroke will draw. */
  preview(context) {
    const { from, last } = this.stroke, colour = this.view.colour("accent");
    const [a, b] = [from, last].map((cell) => this.middle(cell));
    if (this.tool === "wall") this.view.line(context, [a, b], colour, 3);
    if (this.tool === "rectangle") this.view.line(context, [a, [b[0], a[1]], b, [a[0], b[1]], a], colour, 2);
    if (this.tool === "circle") {
      context.beginPath();
      context.arc(...this.view.toScreen(...a), Math.hypot(b[0] - a[0], b[1] - a[1]) * this.view.scale, 0, 2 * Math.PI);
      context.strokeStyle = colour;
      context.lineWidth = 2 * (devicePixelRatio || 1);
      context.stroke();
    }
  }

  ring(context) {
    const radius = (this.size + 0.5) * this.store.grid.resolution;
    context.beginPath();
    context.arc(...this.view.toScreen(...this.cursor), radius * this.view.scale, 0, 2 * Math.PI);
    context.strokeStyle = this.view.colour("soft");
    context.lineWidth = devicePixelRatio || 1;
    context.stroke();
  }

  middle([col, row]) {
    const { grid } = this.store;
    return [grid.origin[0] + (col + 0.5) * grid.resolution, grid.origin[1] + (row + 0.5) * grid.resolution];
  }

  /* Keyboard: the cursor moves cell by cell, and Enter draws there. */
  step(dx, dy) {
    if (this.tool === "move") {
      this.view.move(dx, dy);
      return;
    }
    const { grid } = this.store;
    this.cursor = this.cursor || this.middle([grid.width >> 1, grid.height >> 1]);
    this.cursor = [this.cursor[0] + dx * grid.resolution, this.cursor[1] + dy * grid.resolution];
    if (this.stroke) this.apply(grid.cellAt(...this.cursor));
    this.view.paint();
  }

  enter() {
    if (!this.cursor) return;
    if (this.stroke) {
      this.up();
      return;
    }
    if (this.tool === "move") return;
    const cell = this.store.grid.cellAt(...this.cursor);
    this.store.remember();
    this.stroke = { kind: "draw", from: cell, last: cell, value: this.tool === "eraser" ? 0 : 1 };
    this.apply(cell);
    if (this.tool === "brush" || this.tool === "eraser") this.up();
  }

  /* Turns the start or the goal, rad. */
  turn(which, angle) {
    this.store.remember();
    const pose = this.store[which];
    pose[2] = Math.atan2(Math.sin(pose[2] + angle), Math.cos(pose[2] + angle));
    this.end();
  }

  /* Puts the start or the goal where the cursor is. */
  place(which) {
    if (!this.cursor) return;
    this.store.remember();
    [this.store[which][0], this.store[which][1]] = this.cursor;
    this.end();
  }
}
