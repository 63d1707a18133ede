/* Parameters: those of the controllers and of the costmaps, changed, compared, reset and saved. */

import { row } from "./fields.js";

const byId = (id) => document.getElementById(id);
const SHARED = "costmaps";

export class Parameters {
  constructor(store, server, say, onChange) {
    Object.assign(this, { store, server, say, onChange });
    byId("parameter-owner").addEventListener("change", () => this.show());
    byId("parameter-search").addEventListener("input", () => this.show());
    byId("only-changed").addEventListener("change", () => this.show());
    byId("reset").addEventListener("click", () => this.reset());
    byId("compare").addEventListener("click", () => this.compare());
    byId("save-params").addEventListener("click", () => this.save());
    this.owners();
  }

  get variant() { return this.store.variants.find((one) => one.name === byId("parameter-owner").value) || null; }

  /* The changed values of what is shown. */
  get values() { return this.variant ? this.variant.parameters : this.store.settings.shared; }

  get parameters() { return this.variant ? this.store.parametersOf(this.variant) : this.store.preset().shared; }

  owners() {
    const before = byId("parameter-owner").value;
    const names = this.store.variants.map((one) => new Option(one.name, one.name));
    byId("parameter-owner").replaceChildren(...names, new Option("both costmaps", SHARED));
    if (before && [...byId("parameter-owner").options].some((one) => one.value === before)) byId("parameter-owner").value = before;
    this.show();
  }

  choose(name) {
    byId("parameter-owner").value = name;
    this.show();
  }

  show() {
    const wanted = byId("parameter-search").value.toLowerCase(), only = byId("only-changed").checked;
    const rows = this.parameters
      .filter((one) => `${one.key} ${one.text}`.toLowerCase().includes(wanted) && (!only || one.key in this.values))
      .map((one) => row(one, one.key in this.values ? this.values[one.key] : one.default, one.key in this.values, (value) => this.set(one, value)));
    byId("parameter-list").replaceChildren(...rows);
    byId("compare").disabled = !this.variant || this.store.isFull;
    this.differs();
  }

  /* What differs from the defaults, in words. */
  differs() {
    const changed = this.parameters.filter((one) => one.key in this.values);
    const words = changed.map((one) => `${one.key}: ${JSON.stringify(one.default)} becomes ${JSON.stringify(this.values[one.key])}`);
    const known = new Set(this.parameters.map((one) => one.key));
    words.push(...Object.keys(this.values).filter((key) => !known.has(key)).map((key) => `${key} is no parameter of these, Reset removes it`));
    byId("differs").textContent = words.length ? `What differs: ${words.join("; ")}.` : "Nothing is changed.";
  }

  /* Takes a value; whether it is another than the default. The rows stay, so that the keyboard's focus stays in them. */
  set(parameter, value) {
    const changed = JSON.stringify(value) !== JSON.stringify(parameter.default);
    if (changed) this.values[parameter.key] = value;
    else delete this.values[parameter.key];
    this.differs();
    this.onChange();
    return changed;
  }

  reset() {
    if (this.variant) this.variant.parameters = {};
    else this.store.settings.shared = {};
    this.show();
    this.onChange();
  }

  /* Keeps the present values under their name, and goes on with a copy. */
  compare() {
    if (byId("compare").disabled) return;
    const { controller, parameters } = this.variant;
    const name = this.store.addVariant(controller, parameters);
    this.choose(name);
    this.say(`${name} begins with the same values; change it and compare.`);
    this.onChange();
  }

  async save() {
    try {
      const { name } = this.variant || this.store.variants[0];
      this.say(`Saved ${await this.server.download("save/params", { ...this.store.session(), variant: name })}.`);
    } catch (error) {
      this.say(error.message, true);
    }
  }
}
