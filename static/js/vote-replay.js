// How a planner drives both scenes of a pair, played in step under its pictures. This module, its
// style and the drives are loaded when an expert asks for them first.
import { Drives, View } from "./film.js";
import { at, note, text } from "./vote-page.js";

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

class Replay extends Drives {
  constructor(drives) {
    const [bar, ...films] = parts.content.cloneNode(true).children;
    const [button, range, clock] = bar.children;
    sides.after(bar);
    films.forEach((film, place) => figures[place].append(film));
    document.body.classList.add("replays");
    const views = films.map((film, n) => new View(film.firstElementChild, [drives.a, drives.b][n], ACROSS_M));
    super(views, { place: films[0], button, range, clock, labels: button.dataset });
    Object.assign(this, { bar, films, matchup: matchup() });
    this.listen();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  listen() {
    // Here arrows move in time; on the page they would vote.
    this.bar.addEventListener("keydown", (event) => {
      if (KEPT.includes(event.key)) event.stopPropagation();
    });
    // The next pair takes the place of the pictures, and its own number.
    this.pairs = new MutationObserver(() => matchup() !== this.matchup && this.close());
    figures.forEach((figure) => this.pairs.observe(figure.querySelector(".scene"), { childList: true }));
    this.pause();
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
