/* View: where the map lies on the canvas, and everything that is drawn on it. */

const DASHES = { solid: [], dashed: [10, 6], dotted: [3, 5] };
const MARGIN = 12;
const STEP = 20;
const TEXT = 14;
const LINES_AWAY = [0, 1, -1, 2, -2, 3, -3];

export class View {
  constructor(canvas, store) {
    this.canvas = canvas;
    this.store = store;
    this.zoom = 1;
    this.shift = [0, 0];
    this.walls = document.createElement("canvas");
    this.layers = [];
    this.ground = [];
    this.labels = [];
    this.taken = [];
    this.asked = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.mapChanged());
  }

  /* A layer draws itself: (context). Layers are drawn in their order above the map; those of the ground come first. */
  add(layer) { this.layers.push(layer); }

  addGround(layer) { this.ground.push(layer); }

  /* Draws at once: a new size empties the canvas, and the frame would show it so. */
  resize() {
    const ratio = devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    this.draw();
  }

  colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); }

  /* Pixels of the canvas per metre. */
  get scale() {
    const { grid } = this.store, ratio = devicePixelRatio || 1;
    const across = (this.canvas.width - 2 * MARGIN * ratio) / (grid.width * grid.resolution);
    const up = (this.canvas.height - 2 * MARGIN * ratio) / (grid.height * grid.resolution);
    return Math.max(Math.min(across, up), 1e-3) * this.zoom;
  }

  toScreen(x, y) {
    const { grid } = this.store, scale = this.scale;
    const middle = [grid.origin[0] + grid.width * grid.resolution / 2, grid.origin[1] + grid.height * grid.resolution / 2];
    return [this.canvas.width / 2 + (x - middle[0]) * scale + this.shift[0], this.canvas.height / 2 - (y - middle[1]) * scale + this.shift[1]];
  }

  toWorld(px, py) {
    const { grid } = this.store, scale = this.scale;
    const middle = [grid.origin[0] + grid.width * grid.resolution / 2, grid.origin[1] + grid.height * grid.resolution / 2];
    return [middle[0] + (px - this.canvas.width / 2 - this.shift[0]) / scale, middle[1] - (py - this.canvas.height / 2 - this.shift[1]) / scale];
  }

  /* The point of the map under the pointer. */
  at(event) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    return this.toWorld((event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
  }

  zoomAt(event, factor) {
    const before = this.at(event);
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.5), 40);
    const after = this.at(event);
    this.shift[0] += (after[0] - before[0]) * this.scale;
    this.shift[1] -= (after[1] - before[1]) * this.scale;
    this.paint();
  }

  zoomBy(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.5), 40);
    this.paint();
  }

  /* Moves the map by some steps. */
  move(right, up) {
    this.shift[0] += STEP * right * (devicePixelRatio || 1);
    this.shift[1] -= STEP * up * (devicePixelRatio || 1);
    this.paint();
  }

  fit() {
    this.zoom = 1;
    this.shift = [0, 0];
    this.paint();
  }

  mapChanged() {
    const { grid } = this.store;
    this.walls.width = grid.width;
    this.walls.height = grid.height;
    drawCells(this.walls, grid, this.colour("wall"), this.colour("unknown"));
    this.paint();
  }

  paint() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
    });
  }

  draw() {
    const context = this.canvas.getContext("2d"), { grid } = this.store;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.imageSmoothingEnabled = false;
    const [left, top] = this.toScreen(grid.origin[0], grid.origin[1] + grid.height * grid.resolution);
    const size = grid.resolution * this.scale;
    context.drawImage(this.walls, left, top, grid.width * size, grid.height * size);
    context.strokeStyle = this.colour("wall");
    context.lineWidth = 2;
    context.strokeRect(left, top, grid.width * size, grid.height * size);
    this.labels = [];
    this.taken = [];
    for (const layer of [...this.ground, ...this.layers]) layer(context);
    this.drawLabels(context);
  }

  /* A text at the right of a point of the map, or where there is room for it; texts of the lowest rank have the first choice. */
  label(text, point, rank, rise = 0) { this.labels.push({ text, point, rank, rise }); }

  /* Keeps texts off a circle around a point of the map; the radius is in pixels of the page. */
  keepFree(point, radius) {
    const [x, y] = this.toScreen(...point), reach = radius * (devicePixelRatio || 1);
    this.taken.push([x - reach, y - reach, x + reach, y + reach]);
  }

  drawLabels(context) {
    context.font = `${TEXT * (devicePixelRatio || 1)}px system-ui, sans-serif`;
    context.fillStyle = this.colour("ink");
    context.strokeStyle = this.colour("paper");
    context.lineWidth = 4 * (devicePixelRatio || 1);
    for (const label of this.labels.sort((a, b) => a.rank - b.rank)) {
      const box = this.placed(label, context.measureText(label.text).width);
      this.taken.push(box);
      const place = [box[0], box[3] - 0.25 * (box[3] - box[1])];
      context.strokeText(label.text, ...place);  // a border, so that it can be read on walls
      context.fillText(label.text, ...place);
    }
  }

  /* The box of a text inside the canvas, off what is taken if there is room, as near to its point as possible. */
  placed({ point, rise }, width) {
    const ratio = devicePixelRatio || 1, high = 1.2 * TEXT * ratio, away = 10 * ratio, [x, y] = this.toScreen(...point);
    const into = (value, most) => Math.max(0, Math.min(value, most));
    const boxes = LINES_AWAY.flatMap((line) => [x + away, x - away - width].map((wanted) => {
      const left = into(wanted, this.canvas.width - width), top = into(y - rise * ratio + (line - 0.5) * high, this.canvas.height - high);
      return [left, top, left + width, top + high];
    }));
    return boxes.find((box) => !this.taken.some((other) => overlap(box, other))) || boxes[0];
  }

  /* A line through points of the map. */
  line(context, points, colour, width, line = "solid") {
    if (points.length < 2) return;
    const ratio = devicePixelRatio || 1;
    context.beginPath();
    points.forEach(([x, y], place) => context[place ? "lineTo" : "moveTo"](...this.toScreen(x, y)));
    context.strokeStyle = colour;
    context.lineWidth = width * ratio;
    context.setLineDash(DASHES[line].map((one) => one * ratio));
    context.lineJoin = "round";
    context.stroke();
    context.setLineDash([]);
  }

  dot(context, point, radius, colour) {
    context.beginPath();
    context.arc(...this.toScreen(...point), radius * (devicePixelRatio || 1), 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
  }

  cross(context, point, colour) {
    const [x, y] = this.toScreen(...point), reach = 7 * (devicePixelRatio || 1);
    context.strokeStyle = colour;
    context.lineWidth = 3 * (devicePixelRatio || 1);
    context.beginPath();
    for (const side of [-1, 1]) {
      context.moveTo(x - reach, y - side * reach);
      context.lineTo(x + reach, y + side * reach);
    }
    context.stroke();
  }

  /* The outline of a robot, with a line for its heading. */
  robot(context, [x, y, yaw], robot, colour, filled) {
    const ratio = devicePixelRatio || 1;
    context.beginPath();
    if (robot.footprint) {
      const cos = Math.cos(yaw), sin = Math.sin(yaw);
      robot.footprint.forEach(([fx, fy], place) => context[place ? "lineTo" : "moveTo"](...this.toScreen(x + cos * fx - sin * fy, y + sin * fx + cos * fy)));
      context.closePath();
    } else {
      context.arc(...this.toScreen(x, y), robot.radius * this.scale, 0, 2 * Math.PI);
    }
    context.strokeStyle = colour;
    context.lineWidth = 2 * ratio;
    if (filled) {
      context.fillStyle = colour;
      context.globalAlpha = 0.25;
      context.fill();
      context.globalAlpha = 1;
    }
    context.moveTo(...this.toScreen(x, y));
    context.lineTo(...this.toScreen(x + 1.4 * robot.radius * Math.cos(yaw), y + 1.4 * robot.radius * Math.sin(yaw)));
    context.stroke();
  }
}

/* Whether two boxes [left, top, right, bottom] have a point in common. */
function overlap(a, b) { return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]; }

/* Draws the cells of a grid into a canvas, one pixel a cell, row 0 at the bottom. */
export function drawCells(canvas, grid, wall, unknown) {
  const context = canvas.getContext("2d");
  const image = context.createImageData(grid.width, grid.height);
  const colours = [null, rgb(wall), rgb(unknown)];
  for (let row = 0; row < grid.height; row += 1) {
    for (let col = 0; col < grid.width; col += 1) {
      const place = row * grid.width + col;
      const kind = grid.cells[place] ? 1 : grid.unknown && grid.unknown[place] ? 2 : 0;
      if (kind) image.data.set([...colours[kind], 255], 4 * ((grid.height - 1 - row) * grid.width + col));
    }
  }
  context.putImageData(image, 0, 0);
}

export function rgb(text) {
  const number = parseInt(text.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}
