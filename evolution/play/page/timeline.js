/* Timeline: plays and scrubs the runs. */

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20];
const byId = (id) => document.getElementById(id);

export class Timeline {
  constructor(ways, view, onTime) {
    Object.assign(this, { ways, view, onTime, playing: false, last: 0 });
    SPEEDS.forEach((speed) => byId("speed").add(new Option(`${speed}x`, String(speed), speed === 5, speed === 5)));
    byId("play").addEventListener("click", () => this.toggle());
    byId("scrub").addEventListener("input", () => this.go(Number(byId("scrub").value)));
  }

  toggle() {
    this.playing = !this.playing;
    byId("play").textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) {
      this.onTime();
      return;
    }
    if (this.ways.time >= this.ways.end) this.ways.time = 0;
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    this.show(Math.min(this.ways.time + Math.max(now - this.last, 0) / 1000 * Number(byId("speed").value), this.ways.end));
    this.last = now;
    if (this.ways.time >= this.ways.end) this.toggle();
    else requestAnimationFrame((next) => this.tick(next));
  }

  go(time) {
    this.show(time);
    this.onTime();
  }

  by(seconds) { this.go(Math.min(Math.max(this.ways.time + seconds, 0), this.ways.end)); }

  show(time) {
    this.ways.time = time;
    byId("scrub").max = Math.max(this.ways.end, 0.1).toFixed(2);
    byId("scrub").value = String(time);
    byId("clock").textContent = `${time.toFixed(1)} s`;
    this.view.paint();
  }

  refresh() { this.show(Math.min(this.ways.time, this.ways.end)); }
}
