// What is added, moved and removed, with its history. Knows nothing of the page.
export const EMPTY = { format: "scenario-arena/modification", version: 1 };

export class Edit {
  constructor(scene, document) {
    this.scene = scene;
    this.change = Edit.read(document) ?? Edit.read({});
    this.past = [];
    this.future = [];
    this.selected = null;
    this.presets = {}; // by id, as the server tells them
    this.ways = {};
  }

  // Null where it can't be drawn; the server says why.
  static read(document) {
    const { add = [], move = [], remove = [] } = structuredClone(document ?? {});
    if (![add, move, remove].every(Array.isArray) || ![...add, ...move].every(Edit.isDrawable)) return null;
    return { add, move, remove };
  }

  static isDrawable(agent) {
    const { id, x_m, y_m, heading_rad, length_m, width_m, walk_to_m = [0, 0] } = agent ?? {};
    const isWalk = Array.isArray(walk_to_m) && walk_to_m.length === 2;
    return typeof id === "string" && isWalk && [x_m, y_m, heading_rad, length_m, width_m, ...walk_to_m].every(Number.isFinite);
  }

  // As the server reads it.
  get document() {
    return { ...EMPTY, ...this.change };
  }

  // Everybody but the ego: [agent, what became of it].
  everyone() {
    const moved = new Map(this.change.move.map((agent) => [agent.id, agent]));
    const gone = new Set(this.change.remove);
    const recorded = this.scene.agents.map((agent) => {
      if (gone.has(agent.id)) return [agent, "removed"];
      return moved.has(agent.id) ? [moved.get(agent.id), "moved"] : [agent, "kept"];
    });
    return [...recorded, ...this.change.add.map((agent) => [agent, "added"])];
  }

  find(id) {
    return this.everyone().find(([agent]) => agent.id === id) ?? [null, null];
  }

  // Remember how it was; several changes of one gesture are one step back.
  begin() {
    this.past.push(JSON.stringify(this.change));
    if (this.past.length > 200) this.past.shift();
    this.future = [];
  }

  step(from, to) {
    if (!from.length) return false;
    to.push(JSON.stringify(this.change));
    this.change = JSON.parse(from.pop());
    if (!this.find(this.selected)[0]) this.selected = null;
    return true;
  }

  undo() {
    return this.step(this.past, this.future);
  }

  redo() {
    return this.step(this.future, this.past);
  }

  add(type, x_m, y_m, heading_rad = 0) {
    const taken = new Set(this.everyone().map(([agent]) => agent.id));
    let number = 1;
    while (taken.has(`Added${number}`)) number += 1;
    this.begin();
    const agent = { id: `Added${number}`, type, x_m, y_m, heading_rad, ...this.scene.sizes[type], speed_mps: 0 };
    this.change.add.push(agent);
    this.selected = agent.id;
    return agent;
  }

  // Set fields of an agent; one of the scene is moved by that. Undefined takes a field away.
  set(id, fields) {
    const [agent, was] = this.find(id);
    if (!agent || was === "removed") return;
    const next = { ...agent, ...fields };
    delete next.lane_id; // the server knows what lies below
    for (const name of Object.keys(next)) if (next[name] === undefined) delete next[name];
    next.heading_rad = Math.atan2(Math.sin(next.heading_rad), Math.cos(next.heading_rad));
    if (was === "kept") this.change.move.push(next);
    else this.change[was === "added" ? "add" : "move"].splice(this.place(id, was), 1, next);
  }

  // The end of its walk, which it faces; undefined for none. Who walks has no motion.
  walk(id, walk_to_m) {
    const [agent] = this.find(id);
    if (!agent) return;
    const [dx, dy] = walk_to_m ? [walk_to_m[0] - agent.x_m, walk_to_m[1] - agent.y_m] : [0, 0];
    const motion = walk_to_m ? undefined : agent.motion;
    this.set(id, dx || dy ? { walk_to_m, motion, heading_rad: Math.atan2(dy, dx) } : { walk_to_m, motion });
  }

  // Move it with the end of its walk.
  shift(id, x_m, y_m) {
    const [agent] = this.find(id);
    if (!agent) return;
    const walk = agent.walk_to_m && [agent.walk_to_m[0] + x_m - agent.x_m, agent.walk_to_m[1] + y_m - agent.y_m];
    this.set(id, { x_m, y_m, walk_to_m: walk });
  }

  place(id, was) {
    return this.change[was === "added" ? "add" : "move"].findIndex((agent) => agent.id === id);
  }

  remove(id) {
    const [agent, was] = this.find(id);
    if (!agent || was === "removed") return;
    this.begin();
    if (was !== "kept") this.change[was === "added" ? "add" : "move"].splice(this.place(id, was), 1);
    if (was === "added") this.selected = null;
    else this.change.remove.push(id);
  }

  // As the scene has it.
  restore(id) {
    this.begin();
    this.change.remove = this.change.remove.filter((name) => name !== id);
    this.change.move = this.change.move.filter((agent) => agent.id !== id);
  }

  copy(id) {
    const [agent] = this.find(id);
    if (!agent) return;
    const made = this.add(agent.type, agent.x_m, agent.y_m - agent.width_m - 1, agent.heading_rad);
    const { length_m, width_m, speed_mps = 0 } = agent;
    this.set(made.id, { length_m, width_m, speed_mps });
  }
}
