/* The server of an exported session: it gives what was recorded, and computes nothing. */

const recorded = JSON.parse(document.getElementById("recorded").textContent);
const READ_ONLY = "This is an exported session, which cannot compute. Start mapbench play to change it.";

export class Server extends EventTarget {
  isOpen = true;

  on(type, listener) {
    this.addEventListener(type, (event) => listener(event.detail));
  }

  reply(message) {
    setTimeout(() => this.dispatchEvent(new CustomEvent(message.type, { detail: message })));
  }

  send(message) {
    if (message.type === "drive") this.drive(message);
    else if (message.type === "instant") this.show(message);
    else if (message.type !== "cancel") this.refuse(message);
  }

  drive({ id, ...session }) {
    const asked = JSON.stringify(session);
    this.first ??= asked;
    if (asked !== this.first) return this.refuse({ id });
    for (const message of recorded.replies) this.reply({ ...message, id });
  }

  /* The last recorded instant that is not later. */
  show({ id, variant, repeat, time }) {
    const own = recorded.instants.filter((one) => one.variant === variant && one.repeat === repeat);
    const found = own.findLast((one) => one.time <= time + 1e-6) ?? own[0];
    if (found) this.reply({ ...found, id });
  }

  refuse({ id }) {
    this.reply({ type: "error", id, message: READ_ONLY });
  }

  async state() {
    return recorded.state;
  }

  async post() {
    throw new Error(READ_ONLY);
  }

  async download() {
    throw new Error(READ_ONLY);
  }
}
