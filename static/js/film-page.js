// Films on pages without a vote: each group of pictures has a bar, and loads when it is first played.
import { load, Player } from "./films.js";

const groups = document.querySelectorAll("[data-films]");
for (const group of groups) {
  const bar = group.querySelector(".film-bar");
  const images = [...group.querySelectorAll("img[data-film]")];
  if (!bar || !images.length) continue;
  const frames = images.map((image) => {
    const frame = Object.assign(document.createElement("span"), { className: "reel-frame" });
    image.replaceWith(frame);
    frame.append(image);
    return frame;
  });
  const player = new Player(bar);
  const begin = async (plays, then) => {
    for (const name of ["click", "input"]) bar.removeEventListener(name, first, true);
    bar.classList.remove("is-idle");
    try {
      player.show(await load(images.map((image) => image.dataset.film)), frames, plays);
      then?.();
    } catch {
      bar.hidden = true; // the stills show each second of them
    }
  };
  const first = (event) => {
    event.stopPropagation();
    const wanted = event.target.closest("[data-film]")?.dataset.film;
    const step = Number(player.range.value);
    begin(wanted === "play", () => (wanted ? wanted === "play" || player[wanted]() : player.jump(step)));
  };
  bar.hidden = false;
  if (groups.length > 1) bar.classList.add("is-idle"); // a page of them has a button each
  if (group.dataset.films === "auto") begin();
  else for (const name of ["click", "input"]) bar.addEventListener(name, first, true);
}
