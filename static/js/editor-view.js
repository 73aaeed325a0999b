// The picture with everybody on it. Metres of the ego frame, y turned down: the picture lies where
// the renderer's camera says, so what is placed here is drawn there.
const SVG = "http://www.w3.org/2000/svg";
const ROUND = new Set(["PEDESTRIAN", "TRAFFIC_CONE"]);

function make(name, attributes = {}) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  return node;
}

export class Stage {
  // changed: who is in sight from the beginning, besides the road ahead.
  constructor(svg, scene, picture, changed) {
    const { x_min_m, y_max_m, px_per_m, width_px, height_px } = scene.camera;
    this.svg = svg;
    this.scene = scene;
    this.whole = [x_min_m, -y_max_m, width_px / px_per_m, height_px / px_per_m];
    const [x, y, width, height] = this.whole;
    if (picture) svg.append(make("image", { href: picture, x, y, width, height, preserveAspectRatio: "none" }));
    this.layer = svg.appendChild(make("g"));
    const ratio = (svg.clientHeight || 2) / (svg.clientWidth || 3);
    const left = Math.min(-10, ...changed.map((one) => one.x_m - one.length_m));
    const right = Math.max(36, ...changed.map((one) => one.x_m + one.length_m));
    const aside = Math.max(0, ...changed.map((one) => Math.abs(one.y_m) + one.length_m));
    const seen = Math.min(width, Math.max(right - left, (2 * aside) / ratio));
    this.show([left, (-seen * ratio) / 2, seen, seen * ratio]);
  }

  show(box) {
    this.box = box;
    this.svg.setAttribute("viewBox", box.map((value) => value.toFixed(3)).join(" "));
  }

  // Nearer or further about a point of the drawing.
  zoom(factor, at) {
    const [x, y, width, height] = this.box;
    const centre = at ?? { x: x + width / 2, y: y + height / 2 };
    const next = Math.min(Math.max(width * factor, 6), this.whole[2] * 1.5) / width;
    this.show([centre.x - (centre.x - x) * next, centre.y - (centre.y - y) * next, width * next, height * next]);
  }

  pan(dx, dy) {
    const [x, y, width, height] = this.box;
    this.show([x + dx, y + dy, width, height]);
  }

  // Metres on each screen pixel.
  get unit() {
    return 1 / (this.svg.getScreenCTM()?.a || 10);
  }

  // From the screen to the drawing; y of the ego frame is minus this y.
  at({ clientX, clientY }) {
    return new DOMPoint(clientX, clientY).matrixTransform(this.svg.getScreenCTM().inverse());
  }

  draw(edit) {
    this.layer.replaceChildren();
    const ordered = edit.everyone().sort(([a], [b]) => b.length_m * b.width_m - a.length_m * a.width_m);
    for (const [agent, was] of ordered) this.drawAgent(agent, was, agent.id === edit.selected);
    for (const [id, way] of Object.entries(edit.ways)) if (edit.find(id)[0]?.motion) this.drawWay(way);
    const [agent, was] = edit.find(edit.selected);
    if (agent && was !== "removed") this.drawHandles(agent);
  }

  drawAgent(agent, was, isSelected) {
    const { id, type, x_m, y_m, heading_rad, length_m, width_m } = agent;
    const turn = (-heading_rad * 180) / Math.PI;
    const group = make("g", {
      class: `agent is-${was}${isSelected ? " is-selected" : ""}`,
      transform: `translate(${x_m} ${-y_m}) rotate(${turn})`,
      "data-agent": id,
    });
    const [l, w] = [length_m / 2, width_m / 2];
    // Small things have something to be taken by.
    const grip = 11 * this.unit;
    group.append(make("circle", { class: "grip", r: Math.max(grip, 0.2) }));
    if (ROUND.has(type)) group.append(make("ellipse", { class: "body", rx: l, ry: w }));
    else group.append(make("rect", { class: "body", x: -l, y: -w, width: length_m, height: width_m }));
    if (type !== "TRAFFIC_CONE") {
      const points = [[l * 0.45, -w * 0.7], [l * 0.95, 0], [l * 0.45, w * 0.7]];
      group.append(make("polyline", { class: "nose", points: points.map((p) => p.join(",")).join(" ") }));
    }
    if (agent.speed_mps > 0 && !agent.walk_to_m) {
      group.append(make("line", { class: "speed", x1: l, y1: 0, x2: l + agent.speed_mps, y2: 0 }));
    }
    if (agent.walk_to_m) {
      const [x, y] = agent.walk_to_m;
      this.layer.append(make("line", { class: `walk is-${was}`, x1: x_m, y1: -y_m, x2: x, y2: -y }));
    }
    this.layer.append(group);
  }

  // Where somebody with a motion is each second.
  drawWay(way) {
    this.layer.append(make("polyline", { class: "walk way", points: way.map(([x, y]) => `${x},${-y}`).join(" ") }));
    for (const [x, y] of way) this.layer.append(make("circle", { class: "moment", cx: x, cy: -y, r: 0.25 }));
  }

  drawHandles(agent) {
    const u = this.unit;
    const [cos, sin] = [Math.cos(agent.heading_rad), Math.sin(agent.heading_rad)];
    const reach = agent.length_m / 2 + 26 * u;
    const [x, y] = [agent.x_m + reach * cos, agent.y_m + reach * sin];
    const stem = { x1: agent.x_m + (agent.length_m / 2) * cos, y1: -agent.y_m - (agent.length_m / 2) * sin };
    this.layer.append(make("line", { class: "stem", ...stem, x2: x, y2: -y }));
    this.layer.append(make("circle", { class: "handle", "data-handle": "turn", cx: x, cy: -y, r: 9 * u }));
    if (!agent.walk_to_m) return;
    const [wx, wy] = agent.walk_to_m;
    this.layer.append(make("rect", { class: "handle", "data-handle": "walk", x: wx - 8 * u, y: -wy - 8 * u, width: 16 * u, height: 16 * u }));
  }
}
