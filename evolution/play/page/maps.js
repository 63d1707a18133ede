/* Maps: those of the command line, random ones, opened and dropped files, saved files and links. */

import { Grid } from "./grid.js";
import { fragmentOf } from "./link.js";
import { drawCells } from "./view.js";

const byId = (id) => document.getElementById(id);
const THUMB = 160;

export class Maps {
  constructor(store, view, server, say, onMap) {
    Object.assign(this, { store, view, server, say, onMap });
    byId("map-list").replaceChildren(...store.state.maps.map((one) => thumbnail(one.scene, one.name, view, () => this.take(one.scene))));
    byId("family").append(...store.state.families.map((one) => new Option(one.name, one.name)));
    byId("family").addEventListener("change", () => this.genes());
    byId("draw-random").addEventListener("click", () => this.random());
    byId("open").addEventListener("change", () => this.open([...byId("open").files]));
    byId("save-map").addEventListener("click", () => this.try(async () => this.say(`Saved ${await server.download("save/map", store.scene())}.`)));
    byId("save-session").addEventListener("click", () => this.try(async () => this.say(`Saved ${await server.download("save/session", store.session())}.`)));
    byId("copy-link").addEventListener("click", () => this.copy());
    this.drop(document.body);
    this.genes();
  }

  async try(act) {
    try {
      await act();
    } catch (error) {
      this.say(error.message, true);
    }
  }

  take(scene) {
    this.store.load(scene);
    this.view.fit();
    this.onMap();
  }

  get family() { return this.store.state.families.find((one) => one.name === byId("family").value); }

  /* Genes of the family as handles; one that is not moved is sampled. */
  genes() {
    this.fixed = {};
    byId("genes").replaceChildren(...this.family.genes.map((gene) => this.gene(gene)));
  }

  gene({ name, low, high, default: own, whole }) {
    const label = document.createElement("label"), input = document.createElement("input"), shown = document.createElement("output");
    Object.assign(input, { type: "range", min: low, max: high, step: whole ? 1 : (high - low) / 100, value: own });
    shown.textContent = "sampled";
    input.addEventListener("input", () => {
      this.fixed[name] = Number(input.value);
      shown.textContent = Number(input.value).toPrecision(3);
    });
    input.addEventListener("change", () => this.random());
    label.append(name.replaceAll("_", " "), input, shown);
    return label;
  }

  random() {
    const asked = { family: this.family.name, seed: Number(byId("seed").value), genes: this.fixed };
    return this.try(async () => this.take(await (await this.server.post("random", asked)).json()));
  }

  async open(files) {
    const limit = this.store.state.limits.file_bytes;
    const large = files.find((one) => one.size > limit);
    if (large) {
      this.say(`${large.name}: expected at most ${limit} bytes, got ${large.size}`, true);
      return;
    }
    await this.try(async () => {
      const read = await Promise.all(files.map(async (one) => ({ name: one.name, content: await base64(one) })));
      const scenes = await (await this.server.post("open", { files: read })).json();
      byId("map-list").append(...scenes.map((one) => thumbnail(one, one.name, this.view, () => this.take(one))));
      this.take(scenes[0]);
    });
    byId("open").value = "";
  }

  drop(place) {
    place.addEventListener("dragover", (event) => {
      event.preventDefault();
      place.classList.add("dropping");
    });
    place.addEventListener("dragleave", () => place.classList.remove("dropping"));
    place.addEventListener("drop", (event) => {
      event.preventDefault();
      place.classList.remove("dropping");
      if (event.dataTransfer.files.length) this.open([...event.dataTransfer.files]);
    });
  }

  copy() {
    return this.try(async () => {
      history.replaceState(null, "", `#${await fragmentOf(this.store.scene())}`);
      const copied = await copies(location.href);
      this.say(`The address of this page now holds the map${copied ? ", and is copied" : "; copy it from the address bar"}.`);
    });
  }
}

/* Copies a text; false if the browser does not let the page, as over http from another machine. */
async function copies(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

async function base64(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text);
}

/* A button with a picture of a map. */
export function thumbnail(scene, text, view, act) {
  const button = document.createElement("button"), canvas = document.createElement("canvas"), small = document.createElement("canvas"), words = document.createElement("span");
  const grid = new Grid(scene);
  canvas.width = grid.width;
  canvas.height = grid.height;
  drawCells(canvas, grid, view.colour("wall"), view.colour("unknown"));
  small.width = THUMB;
  small.height = Math.max(Math.round(THUMB * grid.height / grid.width), 1);
  const context = small.getContext("2d"), across = THUMB / (grid.width * grid.resolution);
  context.drawImage(canvas, 0, 0, small.width, small.height);
  for (const [[x, y], colour] of [[scene.start, "#009E73"], [scene.goal, "#D55E00"]]) {
    context.fillStyle = colour;
    context.beginPath();
    context.arc((x - grid.origin[0]) * across, small.height - (y - grid.origin[1]) * across, 5, 0, 2 * Math.PI);
    context.fill();
  }
  button.type = "button";
  button.className = "thumb";
  words.textContent = text;
  button.append(small, words);
  button.addEventListener("click", act);
  return button;
}
