// How a planner drives both scenes of a pair, played in step under its pictures. This module, its
// style and the drives are loaded when an expert asks for them first.
import { coloursIn, View } from "./film.js";
import { at, note, text } from "./vote-page.js";

const STEPS_PER_MS = 0.01;
const ACROSS_M = 70;
const KEPT = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

const parts = at("replay-parts");
const { url, style, none } = parts.dataset;
const [sides] = document.getElementsByClassName("sides");
const figures = [...sides.querySelectorAll(".side")];
const matchup = () => at("vote").dataset.matchup;
let shown = null;

const styled = new Promise((done) => {
  const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href: style });
  link.addEventListener("load", done);
  document.head.append(link);
});

class Replay {
  constructor(drives) {
    this.matchup = matchup();
    const copy = parts.content.cloneNode(true);
    [this.bar, ...this.films] = copy.children;
    [this.button, this.range, this.clock] = this.bar.children;
    sides.after(this.bar);
    this.films.forEach((film, place) => figures[place].append(film));
    document.body.classList.add("replays");
    this.views = this.films.map((film, n) => new View(film.firstElementChild, [drives.a, drives.b][n], ACROSS_M));
    this.last = Math.max(drives.a.steps, drives.b.steps) - 1;
    this.range.max = this.last;
    this.listen();
    this.resize();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  listen() {
    this.button.addEventListener("click", () => (this.from === null ? this.play() : this.pause()));
    this.range.addEventListener("input", () => {
      this.pause();
      this.show(Number(this.range.value));
    });
    // Here arrows move in time; on the page they would vote.
    this.bar.addEventListener("keydown", (event) => {
      if (KEPT.includes(event.key)) event.stopPropagation();
    });
    this.sizes = new ResizeObserver(() => this.resize());
    this.films.forEach((film) => this.sizes.observe(film));
    // The next pair takes the place of the pictures, and its own number.
    this.pairs = new MutationObserver(() => matchup() !== this.matchup && this.close());
    figures.forEach((figure) => this.pairs.observe(figure.querySelector(".scene"), { childList: true }));
    this.pause();
  }

  resize() {
    for (const view of this.views) view.fit();
    this.show(Number(this.range.value));
  }

  play() {
    const step = Number(this.range.value);
    this.from = step < this.last ? step : 0;
    this.begun = performance.now();
    this.button.textContent = this.button.dataset.pause;
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.from = null;
    this.button.textContent = this.button.dataset.play;
  }

  tick(now) {
    if (this.from === null) return;
    this.show(this.from + Math.floor(Math.max(0, now - this.begun) * STEPS_PER_MS));
    if (Number(this.range.value) >= this.last) this.pause();
    else requestAnimationFrame((later) => this.tick(later));
  }

  show(step) {
    const at = Math.min(step, this.last);
    this.range.value = at;
    this.clock.textContent = `${(at / 10).toFixed(1)} s`;
    this.range.setAttribute("aria-valuetext", this.clock.textContent);
    const colours = coloursIn(this.films[0]);
    for (const view of this.views) view.draw(at, { follow: true }, colours);
  }

  close() {
    this.pause();
    this.sizes.disconnect();
    this.pairs.disconnect();
    for (const part of [this.bar, ...this.films]) part.remove();
    document.body.classList.remove("replays");
    at("replay-switch").ariaPressed = false;
    shown = null;
  }
}

// Shows the drives of the pair on the page, or takes them away.
export async function toggleReplay(aids) {
  if (shown) return shown.close();
  const wanted = matchup();
  const [answer] = await Promise.all([
    fetch(url.slice(0, -wanted.length) + wanted, { credentials: "same-origin" }).catch(() => null),
    styled,
  ]);
  if (answer?.status === 404) return note(none);
  if (!answer?.ok) return note(text("unreachable"));
  const drives = await answer.json();
  if (shown || matchup() !== wanted) return;
  shown = new Replay(drives);
  at("replay-switch").ariaPressed = true;
  aids.add("replay");
}
