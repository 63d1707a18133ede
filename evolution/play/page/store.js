/* The session: map, world and variants, with undo and redo; whoever listens hears of each change. */

import { Grid } from "./grid.js";

const MOST_STEPS = 100;
const EDITED = "_edited";
export const LINES = ["solid", "dashed", "dotted"];
const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];

export class Store extends EventTarget {
  constructor(state) {
    super();
    this.state = state;
    this.settings = structuredClone(state.settings);
    this.variants = structuredClone(state.variants);
    this.past = [];
    this.future = [];
    this.load(state.scene);
    this.past = [];
  }

  /* Replaces the map; it can be undone. */
  load(scene) {
    if (this.grid) this.remember();
    this.name = scene.name;
    this.grid = new Grid(scene);
    this.start = [...scene.start];
    this.goal = [...scene.goal];
    this.changed("map");
  }

  /* Keeps the map before a change. The changed map has another name, so that no command takes the file of the first. */
  remember() {
    this.past.push(this.snapshot());
    if (this.past.length > MOST_STEPS) this.past.shift();
    this.future = [];
    if (!this.name.endsWith(EDITED)) this.name = this.name.slice(0, this.state.limits.name - EDITED.length) + EDITED;
  }

  snapshot() {
    return {
      name: this.name, grid: this.grid, cells: this.grid.cells.slice(),
      unknown: this.grid.unknown && this.grid.unknown.slice(), start: [...this.start], goal: [...this.goal],
    };
  }

  undo() { this.travel(this.past, this.future); }

  redo() { this.travel(this.future, this.past); }

  travel(from, to) {
    if (!from.length) return;
    to.push(this.snapshot());
    const then = from.pop();
    Object.assign(this, { name: then.name, grid: then.grid, start: then.start, goal: then.goal });
    this.grid.cells = then.cells;
    this.grid.unknown = then.unknown;
    this.changed("map");
  }

  scene() {
    const { height, width, resolution, origin } = this.grid;
    return { height, width, resolution, origin, ...this.grid.packed(), start: this.start, goal: this.goal, name: this.name };
  }

  session() {
    return { scene: this.scene(), settings: this.settings, variants: this.variants };
  }

  preset() {
    return this.state.presets.find((one) => one.name === this.settings.preset);
  }

  controller(name) {
    return this.state.controllers.find((one) => one.name === name);
  }

  parametersOf(variant) {
    return this.controller(variant.controller).parameters[this.settings.preset] || [];
  }

  get isFull() { return this.variants.length >= this.state.limits.variants; }

  addVariant(controller, parameters = {}) {
    const names = new Set(this.variants.map((one) => one.name));
    let name = controller;
    for (let n = 2; names.has(name); n += 1) name = `${controller} ${n}`;
    this.variants.push({ name, controller, parameters: { ...parameters } });
    this.changed("variants");
    return name;
  }

  removeVariant(name) {
    if (this.variants.length < 2) return;
    this.variants = this.variants.filter((one) => one.name !== name);
    this.changed("variants");
  }

  robot() {
    const robot = this.state.robots.find((one) => one.name === this.settings.robot) || this.preset().robot;
    return this.settings.robot_radius ? { ...robot, radius: this.settings.robot_radius, footprint: null } : robot;
  }

  /* Colour and line of a variant: by its place, so that they are the same everywhere. */
  look(name) {
    const place = Math.max(this.variants.findIndex((one) => one.name === name), 0);
    return { colour: COLOURS[place % COLOURS.length], line: LINES[(place + Math.floor(place / COLOURS.length)) % LINES.length] };
  }

  changed(what) {
    this.dispatchEvent(new CustomEvent("change", { detail: what }));
  }
}
