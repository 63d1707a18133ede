/* Overlays: what the robot of one variant believes and considers at the time of the timeline. */

const KINDS = [
  ["plan", "Global plan", true], ["local", "Local costmap", false], ["global", "Global costmap", false],
  ["lidar", "Lidar", false], ["thoughts", "Thoughts", true],
];
const SAMPLES = 0.35;

export class Overlays {
  constructor(place, view, store, ways, server) {
    Object.assign(this, { view, store, ways, server, instant: null, grids: new Map(), timer: 0 });
    this.boxes = {};
    this.owner = document.createElement("select");
    this.owner.setAttribute("aria-label", "Overlays of");
    this.owner.addEventListener("change", () => this.ask());
    place.append(this.owner);
    for (const [name, label, on] of KINDS) this.boxes[name] = this.box(place, label, on);
    view.addGround((context) => this.drawCosts(context));
    view.add((context) => this.draw(context));
    server.on("instant", (reply) => this.show(reply));
    this.owners();
  }

  box(place, label, on) {
    const wrap = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.checked = on;
    box.addEventListener("change", () => this.ask());
    wrap.append(box, ` ${label}`);
    place.append(wrap);
    return box;
  }

  owners() {
    const before = this.owner.value;
    this.owner.replaceChildren(...this.store.variants.map((one) => new Option(one.name, one.name)));
    if (this.store.variants.some((one) => one.name === before)) this.owner.value = before;
  }

  get wanted() { return Object.values(this.boxes).some((box) => box.checked); }

  forget() {
    this.instant = null;
    clearTimeout(this.timer);
  }

  /* Asks for the instant of the timeline; of many in a row, for the last. */
  ask() {
    clearTimeout(this.timer);
    const run = this.ways.run(this.owner.value, 0);
    if (!this.wanted || !run.result) {
      this.instant = null;
      this.view.paint();
      return;
    }
    this.timer = setTimeout(() => this.server.send({
      type: "instant", id: this.ways.id, variant: this.owner.value, repeat: 0, time: Math.min(this.ways.time, run.result.time),
    }), 60);
  }

  show(reply) {
    if (reply.id !== this.ways.id || reply.variant !== this.owner.value) return;
    this.instant = reply;
    this.grids = new Map();
    for (const [name, grid] of [["global", reply.global_costmap], ["local", reply.local]]) if (grid) this.grids.set(name, painted(grid));
    this.view.paint();
  }

  drawCosts(context) {
    const { instant } = this;
    if (!instant) return;
    const grids = { global: instant.global_costmap, local: instant.local };
    for (const [name, image] of this.grids) if (this.boxes[name].checked) this.costs(context, grids[name], image);
  }

  draw(context) {
    const { instant } = this;
    if (!instant) return;
    const on = (name) => this.boxes[name].checked;
    const { colour } = this.store.look(instant.variant);
    if (on("plan")) this.view.line(context, instant.plan, this.view.colour("ink"), 1.5, "dotted");
    if (on("lidar")) for (const point of instant.lidar) this.view.dot(context, point, 1.5, "#CC0044");
    if (on("thoughts") && instant.thoughts) this.thoughts(context, instant, colour);
    this.view.robot(context, instant.believed, this.store.robot(), this.view.colour("soft"), false);
  }

  costs(context, grid, image) {
    const [x, y] = this.view.toScreen(...grid.origin), size = grid.resolution * this.view.scale;
    context.save();
    context.translate(x, y);
    context.rotate(-grid.yaw);
    context.globalAlpha = 0.6;
    context.drawImage(image, 0, -grid.height * size, grid.width * size, grid.height * size);
    context.restore();
  }

  thoughts(context, { thoughts, pose }, colour) {
    if (thoughts.kind === "dwb") this.candidates(context, thoughts, colour);
    if (thoughts.kind === "mppi") {
      context.globalAlpha = SAMPLES;
      const worst = Math.max(...thoughts.costs), best = Math.min(...thoughts.costs);
      thoughts.samples.forEach((points, place) => this.view.line(context, points, heat((thoughts.costs[place] - best) / (worst - best || 1)), 1));
      context.globalAlpha = 1;
      this.view.line(context, thoughts.chosen, colour, 3);
    }
    if (thoughts.kind === "rpp") {
      this.view.line(context, [pose.slice(0, 2), thoughts.carrot], colour, 2, "dashed");
      this.view.dot(context, thoughts.carrot, 6, colour);
    }
  }

  candidates(context, { candidates, chosen }, colour) {
    const scores = candidates.map((one) => one.score).filter((one) => one !== null);
    const low = Math.min(...scores), high = Math.max(...scores);
    context.globalAlpha = SAMPLES;
    candidates.forEach((one) => this.view.line(context, one.points, one.score === null ? "#888888" : heat((one.score - low) / (high - low || 1)), 1));
    context.globalAlpha = 1;
    if (chosen !== null) this.view.line(context, candidates[chosen].points, colour, 4);
  }

  /* What the controller considers, in words; null if nothing is known at this instant. */
  sentences() {
    const { instant } = this;
    if (!instant) return [];
    const [v, w] = instant.command, lines = [`${instant.variant} at ${instant.time.toFixed(2)} s: ${v.toFixed(2)} m/s, ${w.toFixed(2)} rad/s`];
    const { thoughts } = instant;
    if (thoughts?.kind === "dwb") lines.push(dwbWords(thoughts));
    if (thoughts?.kind === "mppi") lines.push(`${thoughts.samples.length} of its samples are shown, coloured from the lowest cost (blue) to the highest (orange)`);
    if (thoughts?.kind === "rpp") lines.push(`carrot ${thoughts.lookahead.toFixed(2)} m ahead, curvature ${thoughts.curvature.toFixed(2)} 1/m; at most ${thoughts.desired.toFixed(2)} m/s`);
    return lines;
  }
}

function dwbWords({ candidates, critics, chosen }) {
  const refused = candidates.filter((one) => one.score === null);
  const counts = new Map();
  for (const one of refused) counts.set(one.refused, (counts.get(one.refused) || 0) + 1);
  const by = [...counts].map(([name, count]) => `${count} by ${name}`).join(", ");
  const head = `${refused.length} of ${candidates.length} candidates are refused${by ? ` (${by})` : ""}`;
  if (chosen === null) return head;
  const shares = candidates[chosen].shares.map((share, place) => [critics[place], share]).filter(([, share]) => share > 0);
  return `${head}; the chosen one costs ${candidates[chosen].score.toFixed(2)}: ${shares.map(([name, share]) => `${name} ${share.toFixed(2)}`).join(", ")}`;
}

/* From blue (0) to orange (1), which colour-blind readers can tell apart. */
function heat(share) {
  const mix = (a, b) => Math.round(a + (b - a) * Math.min(Math.max(share, 0), 1));
  return `rgb(${mix(0, 230)} ${mix(114, 159)} ${mix(178, 0)})`;
}

/* A costmap in RViz' colours: lethal purple, inscribed cyan, lower costs from blue to red, unknown grey. */
function painted(grid) {
  const canvas = document.createElement("canvas");
  canvas.width = grid.width;
  canvas.height = grid.height;
  const context = canvas.getContext("2d"), image = context.createImageData(grid.width, grid.height);
  const costs = Uint8Array.from(atob(grid.costs), (one) => one.charCodeAt(0));
  for (let row = 0; row < grid.height; row += 1) {
    for (let col = 0; col < grid.width; col += 1) {
      image.data.set(rviz(costs[row * grid.width + col]), 4 * ((grid.height - 1 - row) * grid.width + col));
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function rviz(cost) {
  if (cost === 0) return [0, 0, 0, 0];
  if (cost === 255) return [112, 137, 134, 160];
  if (cost === 254) return [255, 0, 255, 255];
  if (cost === 253) return [0, 255, 255, 255];
  const share = cost / 252;
  return [Math.round(255 * share), 0, Math.round(255 * (1 - share)), 255];
}

