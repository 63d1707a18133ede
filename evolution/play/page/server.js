/* The server: the socket, which connects again by itself, and the requests that save and open. */

const FIRST_WAIT = 500;
const LONGEST_WAIT = 8000;

export class Server extends EventTarget {
  constructor() {
    super();
    this.base = location.pathname.replace(/[^/]*$/, "");
    this.wait = FIRST_WAIT;
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${this.base}socket`);
    this.socket.addEventListener("open", () => {
      this.wait = FIRST_WAIT;
      this.dispatchEvent(new Event("open"));
    });
    this.socket.addEventListener("message", (event) => {
      const reply = JSON.parse(event.data);
      this.dispatchEvent(new CustomEvent(reply.type, { detail: reply }));
    });
    this.socket.addEventListener("close", (event) => {
      this.dispatchEvent(new CustomEvent("lost", { detail: event.reason }));
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    });
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  on(type, listener) {
    this.addEventListener(type, (event) => listener(event.detail));
  }

  async state() {
    return (await fetch(`${this.base}state`)).json();
  }

  async post(name, body) {
    const response = await fetch(this.base + name, { method: "POST", body: JSON.stringify(body) });
    if (!response.ok) throw new Error((await response.text()).trim());
    return response;
  }

  async download(name, body) {
    const response = await this.post(name, body);
    const file = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition"))[1];
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await response.blob());
    link.download = file;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    return file;
  }
}
