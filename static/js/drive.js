// Plays the drives of one page in step: each canvas draws its own trace, one clock drives them all.
import { coloursIn, View } from "./film.js";

const player = document.getElementById("player");
class Player {
  constructor(views) {
    this.views = views;
    this.last = Math.max(...views.map((view) => view.trace.steps)) - 1;
    this.step = 0;
    this.isPlaying = false;
    this.scrub = document.getElementById("scrub");
    this.scrub.max = this.last;
    this.playButton = document.getElementById("play");
    this.names = JSON.parse(document.getElementById("event-names").content.textContent);
    this.listen();
    this.listEvents();
    const sizes = new ResizeObserver(() => this.resize());
    for (const view of views) sizes.observe(view.canvas.parentNode);
    this.resize();
  }

  listen() {
    this.playButton.addEventListener("click", () => (this.isPlaying ? this.pause() : this.play()));
    document.getElementById("back").addEventListener("click", () => this.jump(this.step - 1));
    document.getElementById("on").addEventListener("click", () => this.jump(this.step + 1));
    this.scrub.addEventListener("input", () => this.jump(Number(this.scrub.value)));
    for (const id of ["follow", "proposals"]) {
      document.getElementById(id).addEventListener("change", () => this.show(this.step));
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show(this.step));
  }

  resize() {
    for (const view of this.views) view.fit();
    this.show(this.step);
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

  jump(step) {
    this.pause();
    this.show(step);
  }

  play() {
    if (this.step >= this.last) this.step = 0;
    this.isPlaying = true;
    this.playButton.textContent = player.dataset.pause;
    this.begun = performance.now();
    this.from = this.step;
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.isPlaying = false;
    this.playButton.textContent = player.dataset.play;
  }

  tick(now) {
    if (!this.isPlaying) return;
    const rate = Number(document.getElementById("rate").value);
    if (rate !== this.rate) {
      [this.rate, this.begun, this.from] = [rate, now, this.step];
    }
    this.show(this.from + Math.floor(((now - this.begun) / 100) * rate));
    if (this.step >= this.last) this.pause();
    else requestAnimationFrame((later) => this.tick(later));
  }

  show(step) {
    this.step = Math.max(0, Math.min(step, this.last));
    this.scrub.value = this.step;
    const time = `${(this.step / 10).toFixed(1)} s`;
    document.getElementById("clock").textContent = time;
    this.scrub.setAttribute("aria-valuetext", time);
    const options = {
      follow: document.getElementById("follow").checked,
      proposals: document.getElementById("proposals").checked,
    };
    const colours = coloursIn(player);
    for (const view of this.views) view.draw(this.step, options, colours);
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
