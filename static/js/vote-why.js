// What is wrong, in studies that ask it: an object of either picture is chosen by a click or by the
// key, then a class of fault. Marks are {side, object, fault} and go out with the vote.
import { placeOf, stand } from "./vote-film.js";
import { drawn } from "./vote-lens.js";
import { at, say, showPop, text } from "./vote-page.js";

// A click so near counts, in pixels of the screen.
const NEAR_PX = 24;
const STILL_PX = 5;
const SIDES = ["A", "B"];
const buttons = [...at("why").querySelectorAll("[name=why]")];

export class Why {
  #chosen = null;
  marks = [];

  constructor(lens) {
    this.lens = lens;
    lens.panels.forEach((panel, side) => {
      let from = [];
      panel.addEventListener("pointerdown", ({ clientX, clientY }) => { from = [clientX, clientY]; });
      panel.addEventListener("click", ({ clientX, clientY }) => {
        const isStill = Math.hypot(clientX - from[0], clientY - from[1]) < STILL_PX;
        if (isStill && !lens.isRuling && !lens.isFlipped && !lens.stands) this.#pick(side);
      });
    });
    at("why").addEventListener("toggle", ({ newState }) => newState === "closed" && this.#choose(null));
  }

  get #objects() {
    const { objects } = this.lens.pair.shown;
    return [objects?.a ?? [], objects?.b ?? []];
  }

  // Of another pair, or another vote on it.
  show(marks) {
    this.marks = marks;
    this.#choose(null);
  }

  #pick(side) {
    const { pair: { shown }, end, scenes } = this.lens;
    const near = (NEAR_PX * shown.width) / scenes[side].getBoundingClientRect().width;
    const far = this.#objects[side].map(([x, y, r]) => {
      const [left, top] = placeOf(side, [x, y]);
      return Math.hypot(end[0] - left, end[1] - top) - Math.max(r, near);
    });
    const least = Math.min(...far);
    if (least <= 0) this.#ask([side, far.indexOf(least)]);
  }

  // By the key: one object after the other, those of A first.
  next() {
    const all = this.#objects.flatMap((spots, side) => spots.map((_, object) => [side, object]));
    const now = all.findIndex(([side, object]) => side === this.#chosen?.[0] && object === this.#chosen[1]);
    if (all.length) this.#ask(all[(now + 1) % all.length]);
  }

  #ask(chosen) {
    stand();
    showPop("why");
    this.#choose(chosen);
    const [side, object] = chosen;
    at("why-of").textContent = text("why", SIDES[side], object + 1, this.#objects[side].length);
    say(at("why-of").textContent);
  }

  #choose(chosen) {
    this.#chosen = chosen;
    for (const button of buttons) button.ariaPressed = chosen !== null && this.#has(button.value);
    this.#draw();
  }

  #is = (mark) => mark.side === SIDES[this.#chosen[0]] && mark.object === this.#chosen[1];
  #has = (fault) => this.marks.some((mark) => this.#is(mark) && mark.fault === fault);

  // What is marked after a class was chosen, which takes away one that was.
  mark(fault) {
    const [side, object] = this.#chosen;
    const rest = this.marks.filter((mark) => !this.#is(mark) || mark.fault !== fault);
    this.marks = this.#has(fault) ? rest : [...rest, { side: SIDES[side], object, fault }];
    return this.marks;
  }

  #draw() {
    this.lens.scenes.forEach((scene, side) => {
      const svg = scene.lastElementChild;
      svg.querySelector(".why")?.remove();
      const spots = this.#objects[side].flatMap(([cx, cy, r], object) => {
        const own = this.marks.filter((mark) => mark.side === SIDES[side] && mark.object === object);
        const isChosen = side === this.#chosen?.[0] && object === this.#chosen[1];
        if (!own.length && !isChosen) return [];
        const words = own.map(({ fault }) => buttons.find(({ value }) => value === fault).dataset.word).join(", ");
        const radius = Math.max(r * 1.2, NEAR_PX);
        return [
          drawn("circle", { cx, cy, r: radius, class: isChosen ? "is-chosen" : "" }),
          drawn("text", { x: cx, y: cy - radius - 6 }, words),
        ];
      });
      svg.append(drawn("g", { class: "why" }, ...spots));
    });
  }
}
