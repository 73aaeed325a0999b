// Plays the drives of one page in step: each canvas draws its own trace, one clock drives them all.
import { Drives, View } from "./film.js";

const player = document.getElementById("player");
class Player extends Drives {
  constructor(views) {
    const [button, range, clock] = ["play", "scrub", "clock"].map((id) => document.getElementById(id));
    super(views, { place: player, button, range, clock, labels: player.dataset });
    this.names = JSON.parse(document.getElementById("event-names").content.textContent);
    this.listen();
    this.listEvents();
  }

  options() {
    const [follow, proposals] = ["follow", "proposals"].map((id) => document.getElementById(id).checked);
    return { follow, proposals };
  }

  listen() {
    document.getElementById("back").addEventListener("click", () => this.jump(this.step - 1));
    document.getElementById("on").addEventListener("click", () => this.jump(this.step + 1));
    const rate = document.getElementById("rate");
    rate.addEventListener("change", () => this.setRate(Number(rate.value)));
    this.setRate(Number(rate.value));
    for (const id of ["follow", "proposals"]) {
      document.getElementById(id).addEventListener("change", () => this.show(this.step));
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show(this.step));
  }

  listEvents() {
    const list = document.getElementById("timeline");
    const events = this.views.at(-1).trace.events;
    for (const event of events) {
      const line = document.createElement("li");
      line.className = `is-${event.kind}`;
      const button = document.createElement("button");
      button.type = "button";
      button.className = "button";
      const who = event.object ? ` (${event.object})` : "";
      button.textContent = `${(event.step / 10).toFixed(1)} s ${this.names[event.kind]}${who}`;
      button.addEventListener("click", () => this.jump(event.step));
      line.append(button);
      list.append(line);
      const mark = document.createElement("i");
      mark.className = line.className;
      mark.style.left = `${(100 * event.step) / this.last}%`;
      document.getElementById("marks").append(mark);
    }
  }
}

async function open() {
  const canvases = [...player.querySelectorAll("canvas")];
  const traces = await Promise.all(
    canvases.map(async (canvas) => (await fetch(canvas.dataset.trace, { credentials: "same-origin" })).json()),
  );
  new Player(canvases.map((canvas, n) => new View(canvas, traces[n])));
  player.dataset.ready = "yes";
}

if (player) open();
