// Films of pictures that stand side by side, on one clock: data that is drawn over the picture of
// the empty scene, as the still was. At 0 s where nothing plays the stills themselves are seen; the
// last moment stays.
const RATES = [1, 0.5, 0.25, 2];
const [OUTLINE, RING] = ["#284cc8", "#b5006f"];
// A ring is so much larger than what it is round, and no smaller than this.
const [RING_FACTOR, LEAST_RING_PX] = [1.4, 22];
const KEPT = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];
const isCalm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

async function film(url) {
  const answer = await fetch(url, { credentials: "same-origin" });
  if (!answer.ok) throw new Error(url);
  const read = await answer.json();
  return { ...read, marks: read.marks.map((shapes) => shapes.map(drawing)), movers: read.movers.map(mover) };
}

// Films and, once for each window, what they play over.
export async function load(urls) {
  const films = await Promise.all(urls.map(film));
  const grounds = new Map();
  for (const { window: shown, ground } of films) {
    if (!grounds.has(shown)) grounds.set(shown, Object.assign(new Image(), { src: ground }));
  }
  await Promise.all([...grounds.values()].map((ground) => ground.decode()));
  return films.map((film) => ({ ...film, ground: grounds.get(film.window) }));
}

function drawing({ fill, stroke, width, points = [], disc }) {
  const path = new Path2D();
  for (let n = 0; n < points.length; n += 2) path.lineTo(points[n] / 10, points[n + 1] / 10);
  if (disc) path.arc(disc[0] / 10, disc[1] / 10, disc[2] / 10, 0, 2 * Math.PI);
  if (fill) path.closePath(); // for its outline
  return { path, fill, stroke, width, reach: disc ? disc[2] / 10 : Math.max(...points.map(Math.abs)) / 10 };
}

// Sums of what is added at each step.
function mover([mark, first, last, values]) {
  const poses = [];
  for (let n = 0; n < values.length; n += 3) {
    const before = poses.at(-1) ?? [0, 0, 0];
    poses.push(before.map((value, place) => value + values[n + place] / (place < 2 ? 10 : 1)));
  }
  return { mark, first, last, poses };
}

function surface(width, height, rest) {
  return Object.assign(document.createElement("canvas"), { width, height }, rest);
}

// As many dots as the screen has where the canvas lies, zoomed or not, at most as the stills have.
function fit(canvas, film) {
  const wide = Math.min(2 * film.width, Math.round(canvas.getBoundingClientRect().width * devicePixelRatio));
  if (!wide || canvas.width === wide) return;
  Object.assign(canvas, { width: wide, height: Math.round((wide * film.height) / film.width) });
  film.back = surface(canvas.width, canvas.height);
  const pen = Object.assign(film.back.getContext("2d"), { imageSmoothingQuality: "high" });
  pen.drawImage(film.ground, 0, 0, canvas.width, canvas.height);
  drawPaths(pen, film);
}

// The ways of what is changed: a line, and an outline each second.
function drawPaths(pen, film) {
  const fine = pen.canvas.width / film.width;
  Object.assign(pen, { strokeStyle: OUTLINE, lineWidth: 1.5, globalAlpha: 0.6 });
  for (const { mark, poses } of film.changes) {
    if (poses.length === 1) continue;
    const way = new Path2D();
    for (const [x, y] of poses) way.lineTo(x, y);
    pen.setTransform(fine, 0, 0, fine, 0, 0);
    pen.stroke(way);
    for (let at = 0; at < poses.length; at += Math.round(1 / film.step_s)) {
      place(pen, poses[at], fine);
      pen.stroke(film.marks[mark][0].path);
    }
  }
}

function place(pen, [x, y, turn], fine) {
  pen.setTransform(fine, 0, 0, fine, x * fine, y * fine);
  pen.rotate((turn * Math.PI) / 180);
}

// The pose at a step, between two of them; undefined for who is not there.
export function poseOf({ first, last, poses }, step) {
  if (step < first || step > last) return undefined;
  const at = Math.min(step - first, poses.length - 1);
  const [from, to] = [poses[Math.floor(at)], poses[Math.ceil(at)]];
  return from.map((value, part) => value + (to[part] - value) * (at % 1));
}

// What is changed is ringed for the first second.
function draw(canvas, film, step) {
  fit(canvas, film);
  const pen = canvas.getContext("2d");
  const { back, marks, movers, changes } = film;
  const fine = canvas.width / film.width;
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.drawImage(back, 0, 0);
  for (const mover of movers) {
    const pose = poseOf(mover, step);
    if (!pose) continue;
    place(pen, pose, fine);
    for (const { path, fill, stroke, width: line } of marks[mover.mark]) {
      if (fill) Object.assign(pen, { fillStyle: fill }).fill(path);
      else Object.assign(pen, { strokeStyle: stroke, lineWidth: line }).stroke(path);
    }
  }
  if (step * film.step_s >= 1) return;
  for (const mover of changes) drawRing(pen, film, mover, step, fine);
}

function drawRing(pen, { marks }, mover, step, fine) {
  const pose = poseOf(mover, step);
  if (!pose) return;
  place(pen, pose, fine);
  const ring = new Path2D();
  ring.arc(0, 0, Math.max(LEAST_RING_PX, RING_FACTOR * Math.max(...marks[mover.mark].map(({ reach }) => reach))), 0, 2 * Math.PI);
  Object.assign(pen, { strokeStyle: RING, lineWidth: 3 }).stroke(ring);
}

// Over the still of whoever wants less motion: rings round what is changed, and dashed ones where
// the ego is when somebody sets out.
function hint(film) {
  const canvas = surface(2 * film.width, 2 * film.height, { className: "reel-hint" });
  const pen = canvas.getContext("2d");
  for (const mover of film.changes) drawRing(pen, film, mover, 0, 2);
  pen.setLineDash([8, 6]);
  for (const step of film.movers[film.ego] ? (film.ticks ?? []) : []) drawRing(pen, film, film.movers[film.ego], step, 2);
  return canvas;
}

export class Player {
  #from = null;
  #rate = 0;
  films = [];
  step = 0;

  // bar: buttons that say in data-film what they do, a range, a clock.
  constructor(bar) {
    this.bar = bar;
    [this.range, this.clock] = [bar.querySelector("input"), bar.querySelector("output")];
    for (const button of bar.querySelectorAll("[data-film]")) button.addEventListener("click", () => this[button.dataset.film]());
    this.range.addEventListener("input", () => this.jump(Number(this.range.value)));
    // Here arrows move in time; on a page with votes they would vote.
    bar.addEventListener("keydown", (event) => KEPT.includes(event.key) && event.stopPropagation());
  }

  get isPlaying() {
    return this.#from !== null;
  }

  // Lays films over their stills, each the last but one in its frame, and begins. Films from before
  // they said what is changed show no ways, and neither do those beside one.
  show(films, frames, plays = !isCalm()) {
    this.clear();
    const areNew = films.every(({ changed }) => changed !== undefined);
    this.films = films.map((film) => ({ ...film, changes: areNew && film.changed ? film.movers.slice(-film.changed) : [] }));
    this.canvases = films.map(() => surface(0, 0, { className: "reel", hidden: true }));
    this.canvases.forEach((canvas, place) => frames[place].firstElementChild.after(canvas));
    this.hints = isCalm() && areNew ? this.films.map(hint) : [];
    this.hints.forEach((canvas, place) => frames[place].firstElementChild.after(canvas));
    this.range.max = this.last = films[0].steps - 1;
    this.bar.hidden = false;
    this.#mark(areNew ? films.map(({ ticks }) => ticks) : [], frames);
    this.jump(0);
    if (plays) this.play();
  }

  // Ticks on the range where somebody sets out, those of the first film above it.
  #mark(ticks, frames) {
    const letters = frames.map((frame) => frame.closest("figure")?.querySelector("figcaption b")?.textContent ?? "");
    const marks = ticks.flatMap((steps, side) => steps.map((step) => {
      const tick = Object.assign(document.createElement("i"), { textContent: letters[side] });
      tick.className = side ? "is-below" : "";
      tick.style.setProperty("--at", step / this.last);
      return tick;
    }));
    this.range.nextElementSibling.replaceChildren(...marks);
    const starts = ticks.flatMap((steps, side) => steps.map((step) => `${letters[side]} ${(step * this.films[side].step_s).toFixed(1)} s`.trim()));
    this.range.title = starts.length ? this.bar.dataset.starts.replace("{}", starts.join(", ")) : "";
  }

  clear() {
    this.pause();
    for (const canvas of [...(this.canvases ?? []), ...(this.hints ?? [])]) canvas.remove();
    this.films = [];
    this.bar.hidden = true;
  }

  play() {
    if (!this.films.length) return;
    if (this.isPlaying) return this.pause();
    if (this.step >= this.last) this.step = 0;
    [this.#from, this.begun] = [this.step, performance.now()];
    this.#tell();
    this.paint();
    requestAnimationFrame((now) => this.#tick(now));
  }

  pause() {
    this.#from = null;
    this.#tell();
  }

  back() {
    this.jump(Math.ceil(this.step) - 1);
  }

  on() {
    this.jump(Math.floor(this.step) + 1);
  }

  rate() {
    this.#rate = (this.#rate + 1) % RATES.length;
    if (this.isPlaying) [this.#from, this.begun] = [this.step, performance.now()];
    this.#tell();
  }

  jump(step) {
    if (!this.films.length) return;
    this.#from = null;
    this.step = Math.min(Math.max(step, 0), this.last);
    this.#tell();
    this.paint();
  }

  // Where what began at a place is at this step; undefined for who is not filmed.
  placeOf(side, [x, y]) {
    const film = this.films[side];
    const mover = film?.movers.find(({ first, poses: [[left, top]] }) => first === 0 && Math.hypot(left - x, top - y) < 1);
    return mover && poseOf(mover, this.step);
  }

  #tick(now) {
    if (!this.isPlaying) return;
    const gone = this.#from + (Math.max(0, now - this.begun) * RATES[this.#rate]) / (1000 * this.films[0].step_s);
    if (gone >= this.last) return this.jump(this.last);
    this.step = gone;
    this.paint();
    requestAnimationFrame((later) => this.#tick(later));
  }

  // Also where the stills are zoomed meanwhile.
  paint() {
    if (!this.films.length) return;
    const isStill = !this.isPlaying && this.step === 0;
    for (const canvas of this.hints) canvas.hidden = !isStill;
    this.canvases.forEach((canvas, place) => {
      canvas.hidden = isStill;
      if (!isStill) draw(canvas, this.films[place], this.step);
      const { ego, movers } = this.films[place];
      const pose = movers[ego] && poseOf(movers[ego], this.step);
      if (pose) canvas.dispatchEvent(new CustomEvent("egomoved", { bubbles: true, detail: pose.slice(0, 2) }));
    });
    this.range.value = Math.round(this.step);
    const time = `${(this.step * this.films[0].step_s).toFixed(1)} s`;
    if (time === this.clock.textContent) return;
    this.clock.textContent = time;
    this.range.setAttribute("aria-valuetext", time);
  }

  #tell() {
    const { play, pause } = this.bar.dataset;
    this.bar.querySelector("[data-film=play] span").textContent = this.isPlaying ? pause : play;
    this.bar.querySelector("[data-film=rate] span").textContent = `${RATES[this.#rate]}×`;
  }
}
