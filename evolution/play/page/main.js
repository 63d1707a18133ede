/* The playground: wires map, controllers, server and answers together. */

import { AnswerBox } from "./answer.js";
import { listen } from "./keys.js";
import { sceneIn } from "./link.js";
import { Maps } from "./maps.js";
import { Overlays } from "./overlays.js";
import { Parameters } from "./parameters.js";
import { Search } from "./search.js";
import { Server } from "./server.js";
import { Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { Tools } from "./tools.js";
import { View } from "./view.js";
import { Ways } from "./ways.js";
import { VariantList, WorldBox } from "./world.js";

const byId = (id) => document.getElementById(id);
const PROGRESS_MS = 3000;

class Playground {
  constructor(state, server) {
    this.server = server;
    this.store = new Store(state);
    this.view = new View(byId("map"), this.store);
    this.ways = new Ways(this.view, this.store);
    this.tools = new Tools(byId("tools"), this.view, this.store, () => this.drive());
    this.overlays = new Overlays(byId("overlays"), this.view, this.store, this.ways, server);
    this.timeline = new Timeline(this.ways, this.view, () => this.overlays.ask());
    this.answer = new AnswerBox(this.store);
    this.parameters = new Parameters(this.store, server, say, () => this.variantsChanged());
    this.variants = new VariantList(this.store, this.parameters, () => this.drive());
    new WorldBox(this.store, () => this.drive());
    new Maps(this.store, this.view, server, say, () => this.drive());
    this.search = new Search(this.store, this.view, this.ways, server, () => this.drive());
    listen(this.tools, this.timeline, this.search, this.parameters);
    this.store.addEventListener("change", (event) => this.changed(event.detail));
    for (const moved of ["pointermove", "keyup"]) byId("map").addEventListener(moved, () => this.hover());
    this.replies();
    this.changed("map");
  }

  changed(what) {
    if (what === "map") {
      byId("map-name").textContent = this.store.name;
      this.view.mapChanged();
    }
    if (what === "variants") {
      this.parameters.owners();
      this.overlays.owners();
      this.variants.show();
    }
    this.view.paint();
  }

  variantsChanged() {
    this.variants.show();
    this.drive();
  }

  /* Runs all variants on the map as it is; ends what is under way. */
  drive() {
    this.ways.clear(this.ways.id + 1);
    this.overlays.forget();
    this.search.reset();
    this.answer.begin();
    this.hover();
    clearInterval(this.clock);
    if (!this.server.isOpen) return;
    say("Driving…");
    this.began = performance.now();
    this.clock = setInterval(() => say(this.progress()), PROGRESS_MS);
    this.server.send({ type: "drive", id: this.ways.id, ...this.store.session() });
    this.view.paint();
  }

  /* What the page waits for, where it waits for long. */
  progress() {
    const { variants, settings } = this.store.session();
    const left = variants.map(({ name }) => name).filter((name) => this.ways.finished(name) < settings.repeats);
    const seconds = Math.round((performance.now() - this.began) / 1000);
    return `Driving for ${seconds} s, waiting for ${left.join(", ")}. Any change ends these runs.`;
  }

  replies() {
    const { server, ways } = this;
    server.addEventListener("open", () => this.drive());
    server.on("lost", (reason) => {
      clearInterval(this.clock);
      say(`The server does not answer${reason ? ` (${reason})` : ""}; trying again.`, true);
    });
    server.on("way", (reply) => {
      ways.grow(reply);
      if (!this.timeline.playing) this.timeline.show(ways.end);
    });
    server.on("run", (reply) => ways.finish(reply));
    server.on("answer", (reply) => this.answered(reply));
    server.on("instant", () => this.hover());
    server.on("error", (reply) => {
      say(reply.message, true);
      this.search.end("");
      if (reply.id !== null && reply.id !== ways.id) return;
      clearInterval(this.clock);
      this.answer.fail();
    });
  }

  answered(reply) {
    if (reply.id !== this.ways.id) return;
    clearInterval(this.clock);
    this.answer.show(reply, this.ways.failures());
    this.timeline.refresh();
    this.overlays.ask();
    say(`${this.ways.runs.size} ${this.ways.runs.size === 1 ? "run" : "runs"} in ${((performance.now() - this.began) / 1000).toFixed(2)} s.`);
  }

  /* Numbers under the pointer: the point, the cell, and what the controller considers. */
  hover() {
    const words = [];
    if (this.tools.cursor) {
      const [x, y] = this.tools.cursor;
      words.push(`x ${x.toFixed(2)} m, y ${y.toFixed(2)} m`);
      words.push(...this.near(x, y));
    }
    byId("hover").textContent = [...words, ...this.overlays.sentences()].join(" · ");
  }

  /* The poses of the ways near a point. */
  near(x, y) {
    const found = [];
    for (const run of this.ways.runs.values()) {
      if (run.repeat) continue;
      const pose = run.poses.find((one) => Math.hypot(one[1] - x, one[2] - y) < 0.1);
      if (pose) found.push(`${run.variant} passed at ${pose[0].toFixed(2)} s`);
    }
    return found;
  }
}

function say(text, alarm = false) {
  byId("status").textContent = text;
  byId("status").classList.toggle("alarm", alarm);
}

async function begin() {
  const server = new Server();
  const state = await server.state();
  const scene = await sceneIn(location.hash);
  const playground = new Playground(scene ? { ...state, scene } : state, server);
  if (server.isOpen) playground.drive();
}

begin().catch((error) => say(error.message, true));
