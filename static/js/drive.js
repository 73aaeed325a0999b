// Plays the drives of one page in step: each canvas draws its own trace, one clock drives them all.
const player = document.getElementById("player");
const PX_PER_M = 10;
const BEHIND = 0.3;

class View {
  constructor(canvas, trace) {
    this.canvas = canvas;
    this.trace = trace;
    this.pen = canvas.getContext("2d");
    const xs = trace.ego.poses.map((pose) => pose[0]);
    const ys = trace.ego.poses.map((pose) => pose[1]);
    this.box = [Math.min(...xs) - 20, Math.max(...xs) + 30, Math.min(...ys) - 20, Math.max(...ys) + 20];
  }

  // From metres to the canvas: following the ego at a fixed scale, or the whole drive.
  aim(step, follow) {
    const { width, height } = this.canvas;
    if (follow) {
      const [x, y] = this.trace.ego.poses[step];
      this.scale = PX_PER_M;
      this.left = x - (BEHIND * width) / PX_PER_M;
      this.top = y + height / 2 / PX_PER_M;
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
    this.pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawRoad(colours);
    if (options.proposals) this.drawProposals(at, colours);
    for (const one of this.trace.objects) this.drawObject(one, at, colours);
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
    const plan = this.trace.plans.findLast((one) => one.step <= step);
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

  drawObject(one, step, colours) {
    const still = one.poses.length === 1 && one.first === 0;
    const pose = still ? one.poses[0] : one.poses[step - one.first];
    if (!pose) return;
    const colour = one.changed ? colours.changed : colours.other;
    this.drawBox(pose, one.length_m, one.width_m, colour, colours.ink, one.changed ? 2 : 1);
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
    const braking = this.trace.braking.includes(step);
    this.pen.font = "600 16px sans-serif";
    this.pen.fillStyle = braking ? colours.low : colours.ink;
    const mark = braking ? " ■" : "";
    this.pen.fillText(`${(step * this.trace.step_s).toFixed(1)} s   ${speed.toFixed(1)} m/s${mark}`, 14, 26);
    // A scale of 10 m.
    const y = this.canvas.height - 18;
    this.pen.fillRect(14, y, 10 * this.scale, 3);
    this.pen.fillText("10 m", 14, y - 6);
  }
}

function coloursNow() {
  // Light or dark is settled by the browser: a probe says which colour a variable is right now.
  const probe = document.createElement("i");
  player.append(probe);
  const names = ["ground", "road", "edge", "walk", "lane", "ego", "changed", "other", "ink", "low", "high"];
  const found = {};
  for (const name of names) {
    probe.style.color = `var(--drive-${name})`;
    found[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}

class Player {
  constructor(views) {
    this.views = views;
    this.last = Math.max(...views.map((view) => view.trace.steps)) - 1;
    this.step = 0;
    this.isPlaying = false;
    this.scrub = document.getElementById("scrub");
    this.scrub.max = this.last;
    this.playButton = document.getElementById("play");
    this.names = JSON.parse(document.getElementById("event-names").content.textContent);
    this.listen();
    this.listEvents();
    this.show(0);
  }

  listen() {
    this.playButton.addEventListener("click", () => (this.isPlaying ? this.pause() : this.play()));
    document.getElementById("back").addEventListener("click", () => this.jump(this.step - 1));
    document.getElementById("on").addEventListener("click", () => this.jump(this.step + 1));
    this.scrub.addEventListener("input", () => this.jump(Number(this.scrub.value)));
    for (const id of ["follow", "proposals"]) {
      document.getElementById(id).addEventListener("change", () => this.show(this.step));
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show(this.step));
  }

  listEvents() {
    const list = document.getElementById("timeline");
    const events = this.views.at(-1).trace.events;
    for (const event of events) {
      const line = document.createElement("li");
      line.className = `is-${event.kind}`;
      const button = document.createElement("button");
      button.type = "button";
      button.className = "button";
      const who = event.object ? ` (${event.object})` : "";
      button.textContent = `${(event.step / 10).toFixed(1)} s ${this.names[event.kind]}${who}`;
      button.addEventListener("click", () => this.jump(event.step));
      line.append(button);
      list.append(line);
      const mark = document.createElement("i");
      mark.className = line.className;
      mark.style.left = `${(100 * event.step) / this.last}%`;
      document.getElementById("marks").append(mark);
    }
  }

  jump(step) {
    this.pause();
    this.show(step);
  }

  play() {
    if (this.step >= this.last) this.step = 0;
    this.isPlaying = true;
    this.playButton.textContent = player.dataset.pause;
    this.begun = performance.now();
    this.from = this.step;
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.isPlaying = false;
    this.playButton.textContent = player.dataset.play;
  }

  tick(now) {
    if (!this.isPlaying) return;
    const rate = Number(document.getElementById("rate").value);
    if (rate !== this.rate) {
      [this.rate, this.begun, this.from] = [rate, now, this.step];
    }
    this.show(this.from + Math.floor(((now - this.begun) / 100) * rate));
    if (this.step >= this.last) this.pause();
    else requestAnimationFrame((later) => this.tick(later));
  }

  show(step) {
    this.step = Math.max(0, Math.min(step, this.last));
    this.scrub.value = this.step;
    const time = `${(this.step / 10).toFixed(1)} s`;
    document.getElementById("clock").textContent = time;
    this.scrub.setAttribute("aria-valuetext", time);
    const options = {
      follow: document.getElementById("follow").checked,
      proposals: document.getElementById("proposals").checked,
    };
    const colours = coloursNow();
    for (const view of this.views) view.draw(this.step, options, colours);
  }
}

async function open() {
  const canvases = [...player.querySelectorAll("canvas")];
  const traces = await Promise.all(
    canvases.map(async (canvas) => (await fetch(canvas.dataset.trace, { credentials: "same-origin" })).json()),
  );
  new Player(canvases.map((canvas, n) => new View(canvas, traces[n])));
  player.dataset.ready = "yes";
}

if (player) open();
