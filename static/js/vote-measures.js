// Lines and rings of the instruction over both pictures, and the lane's edges under the ruler.
// Loaded when they are asked for first; they follow from the scenario, whoever drew what.
import { at, given, note, say, text } from "./vote-page.js";

const SVG = "http://www.w3.org/2000/svg";
const COLOUR = "#4b1d7a";
const REST_MS = 150;
const LABEL_PX = 13;
const LEAST_PX = 300;
const LOOK = "position:absolute;right:.5rem;bottom:.5rem;padding:.125rem .375rem;background:#ffffffe6;color:#212529;font-size:.75rem;pointer-events:none";

let shown = null;

function make(name, attributes) {
  const part = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) part.setAttribute(key, value);
  return part;
}

async function ask(pair, query = "") {
  const answer = await fetch(given.urls.measures + pair.shown.matchup + query, { credentials: "same-origin" }).catch(() => null);
  return answer?.ok ? answer.json() : null;
}

class Measures {
  constructor(lens, found) {
    Object.assign(this, { lens, found, pair: lens.pair });
    this.layers = lens.scenes.map((scene) => scene.insertBefore(this.#layer(), scene.lastElementChild));
    this.tags = lens.panels.map((panel) => {
      const tag = document.createElement("span");
      tag.className = "edges";
      tag.hidden = true;
      tag.style.cssText = LOOK;
      return panel.appendChild(tag);
    });
    // Zoom and the next pair change the scenes; the ruler changes what is read of it.
    this.changes = new MutationObserver(() => this.#follow());
    for (const scene of lens.scenes) this.changes.observe(scene, { attributes: true, childList: true });
    for (const reading of document.querySelectorAll(".reading")) this.changes.observe(reading, { childList: true });
    this.#follow();
  }

  #layer() {
    const { width, height } = this.pair.shown;
    const svg = make("svg", { class: "marks measures", "aria-hidden": "true", viewBox: `0 0 ${width} ${height}` });
    svg.style.stroke = COLOUR;
    for (const { at: [cx, cy], r } of this.found.rings) svg.append(make("circle", { cx, cy, r }));
    for (const { points } of this.found.lines) svg.append(make("path", { d: `M${points.join("L")}`, "data-asked": "" }));
    for (const { label, at: [x, y], anchor } of [...this.found.lines, ...this.found.rings.map((ring) => ({ ...ring, at: ring.text }))]) {
      const word = make("text", { x, y, "text-anchor": anchor });
      word.textContent = label;
      svg.append(word);
    }
    return svg;
  }

  // As wide on the screen whatever the zoom.
  #follow() {
    const { lens, pair } = this;
    if (lens.pair !== pair || !this.layers[0].isConnected) return this.close();
    const pixel = pair.shown.width / lens.panels[0].clientWidth / lens.scale;
    for (const svg of this.layers) {
      for (const part of svg.children) {
        const { style, dataset } = part;
        if (part.localName === "text") {
          style.cssText = `fill:${COLOUR};stroke:#fff;stroke-width:${3 * pixel}px;paint-order:stroke;font-size:${LABEL_PX * pixel}px;font-weight:600;text-rendering:geometricPrecision`;
        } else if ("asked" in dataset) style.strokeWidth = `${2 * pixel}px`;
        else style.cssText = `stroke-width:${pixel}px;stroke-dasharray:${2 * pixel} ${5 * pixel}`;
      }
    }
    clearTimeout(this.timer);
    if (lens.isRuling) this.timer = setTimeout(() => this.#read(), REST_MS);
    else this.#tell("");
  }

  async #read() {
    const { lens, pair } = this;
    const end = lens.end;
    if (!end || !lens.isRuling) return;
    const answer = await ask(pair, `?x=${end[0].toFixed(1)}&y=${end[1].toFixed(1)}`);
    if (shown === this && lens.isRuling && String(end) === String(lens.end)) this.#tell(answer?.words ?? "");
  }

  #tell(words) {
    if (words && words !== this.tags[0].textContent) say(`${this.lens.reading}, ${words}`);
    // Small pictures have no room for it.
    const isSmall = this.lens.panels[0].clientWidth < LEAST_PX;
    if (isSmall || this.noted) note((this.noted = isSmall ? words : ""));
    for (const tag of this.tags) {
      tag.hidden = !words || isSmall;
      tag.textContent = words;
    }
  }

  close() {
    clearTimeout(this.timer);
    this.changes.disconnect();
    for (const part of [...this.layers, ...this.tags]) part.remove();
    at("measures").ariaPressed = false;
    shown = null;
  }
}

// Shows them over the pair on the page, or takes them away.
export async function toggle(lens) {
  if (shown) return shown.close();
  const { pair } = lens;
  const found = await ask(pair);
  if (!found) return note(text("unreachable"));
  if (shown || lens.pair !== pair) return;
  shown = new Measures(lens, found);
  lens.aids.add("measures");
  at("measures").ariaPressed = true;
  say(found.lines.map((line) => line.label).join(", "));
}
