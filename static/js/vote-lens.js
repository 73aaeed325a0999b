// Looking closely: zoom, pan, pointer, ruler and the original scene, always in both pictures.
const STEP = 2.5;
const MOST = 8;
// A change takes so much of the frame, within these scales.
const SHARE = 0.6;
const LEAST = 1.5;
const CLOSE = 4;
const SVG = "http://www.w3.org/2000/svg";
const between = (low, value, high) => Math.min(high, Math.max(low, value));

const ARROWS = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
const RING_M = 10;
const LABEL_PX = [22, 9];

export function drawn(name, attributes, ...inside) {
  const element = document.createElementNS(SVG, name);
  for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
  element.append(...inside);
  return element;
}

// Two paths over a picture, in its pixels: the ruler and the pointer; and rings round the ego.
function overlay(shown, say) {
  const viewBox = `0 0 ${shown.width} ${shown.height}`;
  const inside = [drawn("path", {}), drawn("path", {}), drawn("g", { class: "rings" }, ...say ? rings(shown, shown.ego_px, say) : [])];
  const marks = drawn("svg", { class: "marks", "aria-hidden": true, viewBox }, ...inside);
  marks.style.clipPath = cut(shown);
  return marks;
}

// As far as the picture goes, each with its metres where it is seen lowest, beside scale and inset.
function rings({ px_per_m, width, height, covered_px: covered = [] }, [cx, cy], say) {
  const [across, up] = LABEL_PX;
  const isFree = ([x, y]) => x > across && x < width - across && y > up && y < height - up
    && !covered.some(([left, top, right, low]) => x > left - across && x < right + across && y > top - up && y < low + up);
  const farthest = Math.hypot(Math.max(cx, width - cx), Math.max(cy, height - cy));
  const parts = [];
  for (let metres = RING_M; metres * px_per_m < farthest; metres += RING_M) {
    const r = metres * px_per_m;
    parts.push(drawn("circle", { cx, cy, r }));
    const turns = Array.from({ length: 180 }, (_, n) => (n * Math.PI) / 90);
    const places = turns.map((turn) => [cx + r * Math.cos(turn), cy + r * Math.sin(turn)]).filter(isFree);
    const place = places.toSorted((one, other) => other[1] - one[1] || other[0] - one[0])[0];
    if (place) parts.push(drawn("text", { x: place[0], y: place[1] + 5 }, say(metres)));
  }
  return parts;
}

// What is covered, scale and inset, shows through whatever lies over the picture.
export function cut({ width, height, covered_px: covered = [] }) {
  const at = (x, y) => `${(100 * x) / width}% ${(100 * y) / height}%`;
  const holes = covered.map(([left, top, right, low]) => [at(left, top), at(left, low), at(right, low), at(right, top), at(left, top), "0 0"]);
  return `polygon(evenodd, 0 0, 0 100%, 100% 100%, 100% 0, 0 0${holes.flat().map((point) => `, ${point}`).join("")})`;
}

export class Lens {
  #scale = 1;
  // The picture's upper left corner, in widths and heights of the panel.
  #x = 0;
  #y = 0;
  // The pointer, in pixels of the picture.
  #at = null;
  // Where the ruler starts; null: at the ego.
  #from = null;
  #drag = null;
  #pair = null;
  // The frames' height to their width; to measure it for each pair would lay out the page twice.
  #frame = 0;
  #ratio = 0;
  aids = new Set();
  isRuling = false;
  isFlipped = false;
  isPinned = false;
  // "blink", "difference": what stands in the panels instead of the pair's own pictures.
  stands = "";
  hasScale = false;

  constructor(panels, text, changed, hasRings) {
    Object.assign(this, { panels, text, changed, hasRings, scenes: panels.map((panel) => panel.firstElementChild) });
    panels.forEach((panel, place) => this.#listen(panel, this.scenes[place]));
    addEventListener("resize", () => { this.#frame = 0; });
    addEventListener("egomoved", ({ target, detail }) => this.#ring(target.parentNode, detail));
  }

  get scale() {
    return this.#scale;
  }

  get isZoomed() {
    return this.#scale > 1;
  }

  // Puts the pictures of a pair on the page.
  show(pair, keepsZoom) {
    const { width, height } = pair.shown;
    if (this.#ratio !== width / height) this.#frame = 0;
    this.#ratio = width / height;
    const say = this.hasRings && ((metres) => this.text("metres", metres));
    this.#pair = pair;
    this.#at = this.#from = null;
    this.isFlipped = this.isPinned = this.isRuling = false;
    this.stands = "";
    this.aids.clear();
    this.scenes.forEach((scene, place) => scene.replaceChildren(pair.images[place], overlay(pair.shown, say)));
    if (keepsZoom && this.isZoomed) this.aids.add("zoom");
    else this.#begin();
    this.changed(this);
  }

  reset() {
    [this.#scale, this.#x, this.#y] = [1, 0, 0];
    this.#place();
  }

  // As high as the frame, which is higher than the picture on a phone that is held upright.
  #begin() {
    this.reset();
    const { shown: { width, ego_px: [x] }, change } = this.#pair;
    if (this.#room > 1.01) this.#centre(this.#room, change ? (change.left + change.right) / 2 : x / width + 0.15, 0.5);
  }

  // To what either side changed, in parts of the picture; without one to the pointer; or back.
  toggleZoom(change) {
    this.aids.add("zoom");
    if (this.isZoomed) return this.reset();
    const { width, height } = this.#pair.shown;
    const [x, y] = this.#at ?? [width / 2, height / 2];
    if (!change) return this.#centre(STEP, x / width, y / height);
    const { left, right, top, bottom } = change;
    const fits = SHARE * Math.min(1 / (right - left), this.#room / (bottom - top));
    return this.#centre(between(LEAST, fits, CLOSE), (left + right) / 2, (top + bottom) / 2);
  }

  pan(dx, dy) {
    this.#x += dx;
    this.#y += dy;
    this.#place();
  }

  flip(isFlipped, isPinned = false) {
    const { originals, images } = this.#pair;
    if (!originals || isFlipped === this.isFlipped) return;
    [this.isFlipped, this.isPinned] = [isFlipped, isPinned];
    this.put(isFlipped ? originals : images);
    if (isFlipped) this.aids.add(isPinned ? "original" : "flip");
  }

  // Other pictures in the same places; what they are, "" for the pair's own.
  put(pictures, stands = "") {
    this.stands = stands;
    if (stands) this.isFlipped = this.isPinned = false;
    this.scenes.forEach((scene, place) => scene.firstElementChild.replaceWith(pictures[place]));
    if (stands) this.aids.add(stands);
    this.changed(this);
  }

  get pair() {
    return this.#pair;
  }

  // Where the ruler ends, in pixels of the picture.
  get end() {
    return this.#at;
  }

  rule(isOn) {
    this.isRuling = isOn;
    this.#from = null;
    if (isOn) this.aids.add("ruler");
    if (isOn) this.#at ??= this.#pair.shown.ego_px;
    this.#draw();
    this.changed(this);
  }

  // Rings travel with the ego of a film.
  #ring(scene, ego) {
    if (this.hasRings) scene.querySelector(".rings")?.replaceChildren(...rings(this.#pair.shown, ego, (metres) => this.text("metres", metres)));
  }

  // Moves the ruler's end by metres ahead and to the left, for those without a pointer.
  step(ahead_m, left_m) {
    const { px_per_m: scale, width, height } = this.#pair.shown;
    const [x, y] = this.#at;
    this.#at = [between(0, x + ahead_m * scale, width), between(0, y - left_m * scale, height)];
    this.#draw();
  }

  // Whether an arrow moved the ruler or, with Shift, what is zoomed.
  arrow({ key, shiftKey }) {
    const [ahead, left] = ARROWS[key] ?? [];
    if (ahead === undefined) return false;
    if (this.isRuling) this.step(ahead, left);
    else if (shiftKey && this.isZoomed) this.pan(-ahead / 4, left / 4);
    else return false;
    return true;
  }

  // What the ruler says, "" without one. The ego looks to the right of the picture.
  get reading() {
    if (!this.isRuling) return "";
    const { px_per_m: scale } = this.#pair.shown;
    const [[x0, y0], [x, y]] = [this.#start, this.#at];
    const [ahead, left] = [(x - x0) / scale, (y0 - y) / scale];
    const say = (name, metres) => this.text(name, Math.abs(metres).toFixed(1));
    const parts = [say(ahead < 0 ? "behind" : "ahead", ahead), say(left < 0 ? "right" : "left", left)];
    return `${parts.join(", ")} (${say("metres", Math.hypot(ahead, left))})`;
  }

  get #start() {
    return this.#from ?? this.#pair.shown.ego_px;
  }

  // How high the frame is, in heights of the picture that is as wide as it.
  get #room() {
    const { width, height } = this.#pair.shown;
    this.#frame ||= this.panels[0].clientHeight / this.panels[0].clientWidth;
    return this.#frame * (width / height);
  }

  #centre(scale, u, v) {
    this.#scale = between(1, scale, MOST);
    this.#x = 0.5 - u * this.#scale;
    this.#y = 0.5 - v * this.#scale;
    this.#place();
  }

  #zoom(scale, u, v) {
    const next = between(1, scale, MOST);
    this.#x += u * (this.#scale - next);
    this.#y += v * (this.#scale - next);
    this.#scale = next;
    if (next > 1) this.aids.add("zoom");
    this.#place();
  }

  #place() {
    this.#x = between(1 - this.#scale, this.#x, 0);
    const spare = Math.max(0, this.#room - 1) / 2;
    this.#y = this.#scale < 1 + 2 * spare ? (1 - this.#scale) / 2 : between(1 + spare - this.#scale, this.#y, -spare);
    const moved = `translate(${this.#x * 100}%, ${this.#y * 100}%) scale(${this.#scale})`;
    for (const scene of this.scenes) scene.style.transform = this.isZoomed ? moved : "";
    for (const panel of this.panels) panel.classList.toggle("is-zoomed", this.isZoomed);
    // Zoomed pictures have their own scale out of sight.
    if (this.isZoomed || this.hasScale) import("./vote-scale.js").then(({ draw }) => draw(this), () => {});
    this.changed(this);
  }

  // The ruler in both pictures, the pointer in the one that it isn't in.
  #draw(over) {
    const [x, y] = this.#at ?? [];
    const r = this.#pair.shown.width / 90 / this.#scale;
    const cross = this.#at ? `M${x - r} ${y}H${x + r}M${x} ${y - r}V${y + r}` : "";
    for (const { lastElementChild: svg } of this.scenes) {
      const [ruler, pointer] = svg.children;
      svg.style.strokeWidth = r / 4;
      ruler.setAttribute("d", this.isRuling ? `M${this.#start}L${this.#at}${cross}` : "");
      pointer.setAttribute("d", over && svg.parentNode !== over ? cross : "");
    }
    if (this.isRuling) this.changed(this);
  }

  #listen(panel, scene) {
    const on = (name, react, options) => panel.addEventListener(name, (event) => this.#pair && react(event), options);
    const fraction = ({ clientX, clientY }) => {
      const { left, top, width, height } = scene.getBoundingClientRect();
      return [(clientX - left) / width, (clientY - top) / height];
    };
    const follow = (event) => {
      const [u, v] = fraction(event);
      this.#at = [u * this.#pair.shown.width, v * this.#pair.shown.height];
      this.#draw(scene);
    };
    on("pointermove", (event) => {
      if (this.#drag) {
        const [x, y] = this.#drag;
        this.pan((event.clientX - x) / scene.offsetWidth, (event.clientY - y) / scene.offsetHeight);
        this.#drag = [event.clientX, event.clientY];
      }
      follow(event);
    });
    on("pointerdown", (event) => {
      follow(event);
      if (this.isRuling) this.#from = this.#at;
      else if (this.isZoomed && event.button === 0) {
        this.#drag = [event.clientX, event.clientY];
        panel.setPointerCapture(event.pointerId);
      }
    });
    on("lostpointercapture", () => { this.#drag = null; });
    on("pointerleave", () => {
      if (this.isRuling) return;
      this.#at = null;
      this.#draw();
    });
    on("wheel", (event) => {
      const root = document.documentElement;
      // The wheel is the page's.
      if (event.ctrlKey || root.scrollHeight > root.clientHeight) return;
      event.preventDefault();
      this.#zoom(this.#scale * Math.exp(-event.deltaY / 500), ...fraction(event));
    }, { passive: false });
  }
}
