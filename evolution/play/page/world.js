/* World: parameters, robot, noise, seed and repeats that all variants share; and the list of variants. */

import { sample } from "./answer.js";
import { choice } from "./fields.js";

const byId = (id) => document.getElementById(id);

export class WorldBox {
  constructor(store, onChange) {
    Object.assign(this, { store, onChange });
    const { presets, robots, noise_levels: levels, limits } = store.state;
    this.row("Parameters", choice(presets.map((one) => [one.name, `${one.name}: ${one.label}`]), store.settings.preset, (name) => this.preset(name)));
    this.row("Robot", choice([["", "of the parameters"], ...robots.map((one) => [one.name, one.name])], store.settings.robot, (name) => this.set("robot", name)));
    this.row("Robot radius, m", this.number({ min: 0.02, max: 5, step: 0.001 }, store.settings.robot_radius, (value) => this.set("robot_radius", value)));
    this.row("Noise", choice(levels, store.settings.noise, (name) => this.set("noise", name)));
    this.row("Seed", this.number({ min: 0, max: Number.MAX_SAFE_INTEGER, step: 1 }, store.settings.seed, (value) => this.set("seed", value ?? 0)));
    this.row("Runs of each", this.number({ min: 1, max: limits.repeats, step: 1 }, store.settings.repeats, (value) => this.set("repeats", value ?? 1)));
  }

  row(title, input) {
    const label = document.createElement("label");
    label.append(title, input);
    byId("world-list").append(label);
  }

  /* An input for a number; empty means none. */
  number(limits, value, onValue) {
    const input = document.createElement("input");
    Object.assign(input, { type: "number", ...limits, value: value ?? "" });
    input.addEventListener("change", () => {
      if (input.reportValidity()) onValue(input.value === "" ? null : Number(input.value));
    });
    return input;
  }

  preset(name) {
    this.store.settings.preset = name;
    this.store.changed("variants");
    this.onChange();
  }

  set(name, value) {
    this.store.settings[name] = value;
    this.store.changed("settings");
    this.onChange();
  }
}

export class VariantList {
  constructor(store, parameters, onChange) {
    Object.assign(this, { store, parameters, onChange });
    byId("controller-choice").append(...store.state.controllers.map((one) => new Option(one.label, one.name)));
    byId("add-variant").addEventListener("click", () => this.add());
    this.show();
  }

  add() {
    this.parameters.choose(this.store.addVariant(byId("controller-choice").value));
    this.onChange();
  }

  show() {
    byId("add-variant").disabled = this.store.isFull;
    byId("variant-list").replaceChildren(...this.store.variants.map((one) => this.row(one)));
  }

  row(variant) {
    const shown = document.createElement("div"), name = document.createElement("span"), changed = Object.keys(variant.parameters).length;
    shown.className = "variant";
    name.className = "name";
    name.textContent = variant.name + (changed ? ` (${changed} changed)` : "");
    const change = button("Parameters", () => {
      this.parameters.choose(variant.name);
      byId("parameters").scrollIntoView({ block: "nearest" });
    });
    const remove = button("Remove", () => {
      this.store.removeVariant(variant.name);
      this.onChange();
    });
    remove.disabled = this.store.variants.length < 2;
    shown.append(sample(this.store.look(variant.name)), name, change, remove);
    return shown;
  }
}

function button(text, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.addEventListener("click", act);
  return made;
}
