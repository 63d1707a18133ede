/* Ways: the runs of the last drive while they are computed, and where each robot is at a time. */

export class Ways {
  constructor(view, store) {
    this.view = view;
    this.store = store;
    this.clear(-1);
    view.add((context) => this.draw(context));
  }

  clear(id) {
    this.id = id;
    this.runs = new Map();
    this.time = 0;
    this.end = 0;
  }

  run(variant, repeat) {
    const key = `${variant}\n${repeat}`;
    if (!this.runs.has(key)) this.runs.set(key, { variant, repeat, poses: [], result: null });
    return this.runs.get(key);
  }

  grow(way) {
    if (way.id !== this.id) return;
    const run = this.run(way.variant, way.repeat);
    run.poses.length = way.first;
    run.poses.push(...way.poses);
    this.end = Math.max(this.end, run.poses.at(-1)?.[0] || 0);
    this.view.paint();
  }

  finish(result) {
    if (result.id !== this.id) return;
    this.run(result.variant, result.repeat).result = result;
    this.view.paint();
  }

  finished(variant) { return [...this.runs.values()].filter((run) => run.variant === variant && run.result).length; }

  failures() { return [...this.runs.values()].map((run) => run.result).filter((one) => one && one.outcome !== "goal"); }

  poseAt(run, time) {
    const { poses } = run;
    let low = 0, high = poses.length - 1;
    while (low < high) {
      const half = (low + high + 1) >> 1;
      if (poses[half][0] <= time) low = half;
      else high = half - 1;
    }
    return poses[low];
  }

  draw(context) {
    for (const run of this.runs.values()) {
      const { colour, line } = this.store.look(run.variant);
      context.globalAlpha = run.repeat ? 0.35 : 1;
      this.view.line(context, run.poses.map((pose) => pose.slice(1, 3)), colour, run.repeat ? 1.5 : 3, line);
      context.globalAlpha = 1;
      if (run.repeat === 0 && run.poses.length) this.view.robot(context, this.poseAt(run, this.time).slice(1), this.store.robot(), colour, true);
    }
    for (const one of this.failures()) {
      if (!one.where) continue;
      const { colour } = this.store.look(one.variant);
      this.view.cross(context, one.where, colour);
      this.view.keepFree(one.where, 7);
      if (!one.repeat) this.view.label(`${one.variant}: ${one.outcome.replaceAll("_", " ")}`, one.where, 1);
    }
  }
}
