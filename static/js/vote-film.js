// The films of the pair on the page, in studies that have some.
import { cut } from "./vote-lens.js";
import { note, text } from "./vote-page.js";

const bar = document.querySelector(".film-bar");
const player = bar && new (await import("./films.js")).Player(bar);
// What is zoomed is drawn finer, also where it stands.
for (const scene of bar ? document.querySelectorAll(".panel > .scene") : []) {
  new MutationObserver(() => player.paint()).observe(scene, { attributeFilter: ["style"] });
}

export const filmActions = Object.fromEntries(["play", "back", "on", "rate"].map((name) => [name, () => player[name]()]));

// Where something is now that a still shows at a place, both in pixels of the picture.
export const placeOf = (side, spot) => player?.placeOf(side, spot) ?? spot;

// The stills, where things are marked.
export const stand = () => player?.jump(0);

// Both at once, in the frame of their stills where they are there already.
export function roll(pair, frames, isShown) {
  player?.clear();
  if (!player || !pair.shown.is_filmed) return;
  if (!pair.films) note(text("film-lost"));
  else if (pair.films instanceof Promise) pair.films.then(() => isShown() && roll(pair, frames, isShown));
  else {
    player.show(pair.films, frames);
    for (const canvas of [...player.canvases, ...player.hints]) canvas.style.clipPath = cut(pair.shown);
  }
}
