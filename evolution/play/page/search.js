/* Search: changes of the map that the server finds in the background. */

import { thumbnail } from "./maps.js";

const byId = (id) => document.getElementById(id);

export class Search {
  constructor(store, view, ways, server, onMap) {
    Object.assign(this, { store, view, ways, server, onMap });
    byId("harder").addEventListener("click", () => this.begin({ type: "search", goal: "harder" }));
    byId("apart").addEventListener("click", () => this.begin({ type: "search", goal: "apart" }));
    byId("why").addEventListener("click", () => this.why());
    byId("stop").addEventListener("click", () => this.stop());
    server.on("offers", (reply) => this.show(reply));
  }

  begin(message) {
    byId("stop").hidden = false;
    byId("search-text").textContent = "Searching…";
    byId("offers").replaceChildren();
    this.server.send({ ...message, id: this.ways.id });
  }

  /* The outcome to be explained: the first failure, else that the slowest stays slowest. */
  why() {
    const failed = this.ways.failures()[0];
    const done = [...this.ways.runs.values()].filter((run) => run.result && run.repeat === 0);
    const order = done.sort((a, b) => b.result.time - a.result.time).map((run) => run.variant);
    if (failed) this.begin({ type: "why", verdict: `${failed.variant} fails` });
    else if (order.length > 1) this.begin({ type: "why", verdict: "order" });
    else byId("search-text").textContent = "Nothing to explain: no run failed, and there is only one controller.";
  }

  stop() {
    this.server.send({ type: "cancel" });
    this.end("Stopped.");
  }

  end(text) {
    byId("stop").hidden = true;
    byId("search-text").textContent = text;
  }

  reset() {
    byId("offers").replaceChildren();
    this.end("");
  }

  show(reply) {
    if (reply.id !== this.ways.id) return;
    const progress = reply.finished ? "" : ` ${reply.done} of ${reply.of} runs.`;
    byId("search-text").textContent = `${reply.text}${progress}`;
    byId("stop").hidden = reply.finished;
    byId("offers").replaceChildren(...reply.offers.map((one) => thumbnail(one.scene, one.text, this.view, () => {
      this.store.load(one.scene);
      this.onMap();
    })));
  }
}
