// Films of pictures that stand side by side, on one clock: data that is drawn over the picture of
// the empty scene, as the still was. After each round, and at 0 s where nothing plays, the stills
// themselves are seen.
const RATES = [1, 0.5, 0.25, 2];
const [END_STEPS, STILL_STEPS] = [5, 15];
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
  return films.map((one) => ({ ...one, ground: grounds.get(one.window) }));
}

function drawing({ fill, stroke, width, points = [], disc }) {
  const path = new Path2D();
  for (let n = 0; n < points.length; n += 2) path.lineTo(points[n] / 10, points[n + 1] / 10);
  if (disc) path.arc(disc[0] / 10, disc[1] / 10, disc[2] / 10, 0, 2 * Math.PI);
  return { path, fill, stroke, width };
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
}

function draw(canvas, film, step) {
  fit(canvas, film);
  const pen = canvas.getContext("2d");
  const { back, marks, movers } = film;
  const fine = canvas.width / film.width;
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.drawImage(back, 0, 0);
  for (const { mark, first, last, poses } of movers) {
    if (step < first || step > last) continue;
    const at = Math.min(step - first, poses.length - 1);
    const [from, to] = [poses[Math.floor(at)], poses[Math.ceil(at)]];
    const [x, y, turn] = from.map((value, place) => value + (to[place] - value) * (at % 1));
    pen.setTransform(fine, 0, 0, fine, x * fine, y * fine);
    pen.rotate((turn * Math.PI) / 180);
    for (const { path, fill, stroke, width: line } of marks[mark]) {
      if (fill) Object.assign(pen, { fillStyle: fill }).fill(path);
      else Object.assign(pen, { strokeStyle: stroke, lineWidth: line }).stroke(path);
    }
  }
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

  // Lays films over their stills, each the last but one in its frame, and begins.
  show(films, frames, plays = !isCalm()) {
    this.clear();
    this.films = films;
    this.canvases = films.map(() => surface(0, 0, { className: "reel", hidden: true }));
    this.canvases.forEach((canvas, place) => frames[place].firstElementChild.after(canvas));
    this.range.max = this.last = films[0].steps - 1;
    this.bar.hidden = false;
    this.jump(0);
    if (plays) this.play();
  }

  clear() {
    this.pause();
    for (const canvas of this.canvases ?? []) canvas.remove();
    this.films = [];
    this.bar.hidden = true;
  }

  play() {
    if (!this.films.length) return;
    if (this.isPlaying) return this.pause();
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

  #tick(now) {
    if (!this.isPlaying) return;
    const gone = this.#from + (Math.max(0, now - this.begun) * RATES[this.#rate]) / (1000 * this.films[0].step_s);
    const at = gone % (this.last + END_STEPS + STILL_STEPS);
    const rests = at > this.last + END_STEPS;
    this.step = rests ? 0 : Math.min(at, this.last);
    this.paint(rests);
    requestAnimationFrame((later) => this.#tick(later));
  }

  // Also where the stills are zoomed meanwhile.
  paint(rests = !this.isPlaying) {
    if (!this.films.length) return;
    const isStill = rests && this.step === 0;
    this.canvases.forEach((canvas, place) => {
      canvas.hidden = isStill;
      if (!isStill) draw(canvas, this.films[place], this.step);
    });
    this.range.value = Math.round(this.step);
    const said = `${(this.step * this.films[0].step_s).toFixed(1)} s`;
    if (said === this.clock.textContent) return;
    this.clock.textContent = said;
    this.range.setAttribute("aria-valuetext", said);
  }

  #tell() {
    const { play, pause } = this.bar.dataset;
    this.bar.querySelector("[data-film=play] span").textContent = this.isPlaying ? pause : play;
    this.bar.querySelector("[data-film=rate] span").textContent = `${RATES[this.#rate]}×`;
  }
}
