// A drive from above on a canvas: road, proposals, everybody, the ego.
const BEHIND = 0.3;

export class View {
  // across: how many metres the canvas is wide when it follows the ego.
  constructor(canvas, trace, across = 90) {
    Object.assign(this, { canvas, trace, across });
    this.pen = canvas.getContext("2d");
    const xs = trace.ego.poses.map((pose) => pose[0]);
    const ys = trace.ego.poses.map((pose) => pose[1]);
    this.box = [Math.min(...xs) - 20, Math.max(...xs) + 30, Math.min(...ys) - 20, Math.max(...ys) + 20];
  }

  // As many dots as the screen has where the canvas lies; lengths below are in pixels of the page.
  fit() {
    const dots = devicePixelRatio || 1;
    const { canvas } = this;
    [this.width, this.height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = Math.round(this.width * dots);
    canvas.height = Math.round(this.height * dots);
    this.pen.setTransform(dots, 0, 0, dots, 0, 0);
    this.pen.lineJoin = "round";
  }

  // From metres to the canvas: following the ego at a fixed scale, or the whole drive.
  aim(step, follow) {
    const { width, height } = this;
    if (follow) {
      const [x, y] = this.trace.ego.poses[step];
      this.scale = width / this.across;
      this.left = x - BEHIND * this.across;
      this.top = y + height / 2 / this.scale;
      return;
    }
    const [left, right, bottom, top] = this.box;
    this.scale = Math.min(width / (right - left), height / (top - bottom));
    this.left = (left + right) / 2 - width / 2 / this.scale;
    this.top = (top + bottom) / 2 + height / 2 / this.scale;
  }

  path(flat, close) {
    this.pen.beginPath();
    for (let n = 0; n < flat.length; n += 2) {
      const x = (flat[n] - this.left) * this.scale;
      const y = (this.top - flat[n + 1]) * this.scale;
      if (n === 0) this.pen.moveTo(x, y);
      else this.pen.lineTo(x, y);
    }
    if (close) this.pen.closePath();
  }

  fill(flat, colour) {
    this.path(flat, true);
    this.pen.fillStyle = colour;
    this.pen.fill();
  }

  stroke(flat, colour, width, close = false) {
    this.path(flat, close);
    this.pen.strokeStyle = colour;
    this.pen.lineWidth = width;
    this.pen.stroke();
  }

  draw(step, options, colours) {
    const at = Math.min(step, this.trace.steps - 1);
    this.aim(at, options.follow);
    this.pen.fillStyle = colours.ground;
    this.pen.fillRect(0, 0, this.width, this.height);
    this.drawRoad(colours);
    if (options.proposals) this.drawProposals(at, colours);
    for (const object of this.trace.objects) this.drawObject(object, at, colours);
    const ego = this.trace.ego;
    this.drawBox(ego.poses[at], ego.length_m, ego.width_m, colours.ego, colours.ink, 2);
    this.drawText(at, colours);
  }

  drawRoad(colours) {
    const road = this.trace.road;
    for (const ring of road.walkways) this.fill(ring, colours.walk);
    for (const [outer, ...holes] of road.drivable) {
      this.fill(outer, colours.road);
      this.stroke(outer, colours.edge, 1.5, true);
      for (const hole of holes) this.fill(hole, colours.ground);
    }
    for (const ring of road.crosswalks) this.fill(ring, colours.lane);
    for (const lane of road.lanes) {
      this.stroke(lane.edge, colours.lane, 1, true);
      this.pen.setLineDash([6, 8]);
      this.stroke(lane.line, lane.is_red ? colours.low : colours.edge, lane.on_route ? 1.5 : 0.75);
      this.pen.setLineDash([]);
    }
  }

  drawProposals(step, colours) {
    const plan = this.trace.plans.findLast((plan) => plan.step <= step);
    if (!plan) return;
    const order = plan.scores.map((score, n) => [score, n]).sort((a, b) => a[0] - b[0]);
    for (const [score, n] of order) {
      const colour = `color-mix(in oklab, ${colours.high} ${Math.round(100 * score)}%, ${colours.low})`;
      this.pen.globalAlpha = n === plan.chosen ? 1 : 0.45;
      this.stroke(plan.lines[n], colour, n === plan.chosen ? 4 : 1.25);
    }
    this.pen.globalAlpha = 1;
    const best = plan.lines[plan.chosen];
    this.stroke(best, colours.high, 4);
  }

  drawObject(object, step, colours) {
    const still = object.poses.length === 1 && object.first === 0;
    const pose = still ? object.poses[0] : object.poses[step - object.first];
    if (!pose) return;
    const colour = object.changed ? colours.changed : colours.other;
    this.drawBox(pose, object.length_m, object.width_m, colour, colours.ink, object.changed ? 2 : 1);
  }

  drawBox([x, y, heading], length, width, colour, ink, line) {
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    const turned = (along, left) => [x + along * cos - left * sin, y + along * sin + left * cos];
    const [l, w] = [length / 2, width / 2];
    const rim = [turned(l, w), turned(-l, w), turned(-l, -w), turned(l, -w)].flat();
    this.fill(rim, colour);
    this.stroke(rim, ink, line, true);
    if (length > 1.5) {
      this.stroke([turned(l * 0.5, w * 0.8), turned(l, 0), turned(l * 0.5, -w * 0.8)].flat(), ink, 1.5);
    }
  }

  drawText(step, colours) {
    const speed = this.trace.ego.poses[step][3];
    const braking = this.trace.braking?.includes(step);
    this.pen.font = "600 14px sans-serif";
    this.pen.fillStyle = braking ? colours.low : colours.ink;
    const mark = braking ? " ■" : "";
    const time = `${(step * this.trace.step_s).toFixed(1)} s   ${speed.toFixed(1)} m/s${mark}`;
    this.say(time, 26, colours);
    // A scale of 10 m.
    const y = this.height - 14;
    this.pen.fillRect(14, y, 10 * this.scale, 3);
    this.say("10 m", y - 6, colours);
  }

  // Words that can be read on any ground.
  say(words, y, colours) {
    this.pen.strokeStyle = colours.ground;
    this.pen.lineWidth = 4;
    this.pen.strokeText(words, 14, y);
    this.pen.fillText(words, 14, y);
  }
}

const STEPS_PER_MS = 0.01;

// Drives on one clock: all views stand at the step that the range says.
export class Drives {
  // place: what has the class "film"; labels: what play and pause are called.
  constructor(views, { place, button, range, clock, labels }) {
    Object.assign(this, { views, place, button, range, clock, labels, from: null, rate: 1 });
    this.last = range.max = Math.max(...views.map((view) => view.trace.steps)) - 1;
    button.addEventListener("click", () => (this.from === null ? this.play() : this.pause()));
    range.addEventListener("input", () => this.jump(this.step));
    this.sizes = new ResizeObserver(() => this.resize());
    for (const view of views) this.sizes.observe(view.canvas.parentNode);
    this.resize();
  }

  get step() {
    return Number(this.range.value);
  }

  options() {
    return { follow: true };
  }

  resize() {
    for (const view of this.views) view.fit();
    this.show(this.step);
  }

  jump(step) {
    this.pause();
    this.show(step);
  }

  play() {
    [this.from, this.begun] = [this.step < this.last ? this.step : 0, performance.now()];
    this.button.textContent = this.labels.pause;
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.from = null;
    this.button.textContent = this.labels.play;
  }

  // A new rate begins where the drives are.
  setRate(rate) {
    this.rate = rate;
    if (this.from !== null) [this.from, this.begun] = [this.step, performance.now()];
  }

  tick(now) {
    if (this.from === null) return;
    this.show(this.from + Math.floor(Math.max(0, now - this.begun) * STEPS_PER_MS * this.rate));
    if (this.step >= this.last) this.pause();
    else requestAnimationFrame((later) => this.tick(later));
  }

  show(step) {
    const at = Math.max(0, Math.min(step, this.last));
    this.range.value = at;
    this.clock.textContent = `${(at / 10).toFixed(1)} s`;
    this.range.setAttribute("aria-valuetext", this.clock.textContent);
    const colours = coloursIn(this.place);
    for (const view of this.views) view.draw(at, this.options(), colours);
  }
}

// The colours of a place in the page that has the class "film".
export function coloursIn(place) {
  // Light or dark is settled by the browser: a probe says which colour a variable is right now.
  const probe = document.createElement("i");
  place.append(probe);
  const names = ["ground", "road", "edge", "walk", "lane", "ego", "changed", "other", "ink", "low", "high"];
  const colours = {};
  for (const name of names) {
    probe.style.color = `var(--drive-${name})`;
    colours[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return colours;
}
