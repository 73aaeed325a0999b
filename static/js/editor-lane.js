// The ego's way over its lanes as one line, on which objects are placed: metres along it from the
// ego on, and to its left. Before its first point and after its last it goes straight on.
export class Lane {
  constructor({ points, ego_s_m }) {
    let s = -ego_s_m;
    this.parts = points.slice(1).map(([x1, y1], index) => {
      const [x, y] = points[index];
      const length = Math.hypot(x1 - x, y1 - y) || 1e-9;
      const part = { x, y, s, length, ux: (x1 - x) / length, uy: (y1 - y) / length };
      s += length;
      return part;
    });
  }

  /** Where a point lies, and the lane's heading there. */
  project(x_m, y_m) {
    const last = this.parts.length - 1;
    const places = this.parts.map((part, index) => {
      const [dx, dy] = [x_m - part.x, y_m - part.y];
      const along = dx * part.ux + dy * part.uy;
      const t = Math.min(Math.max(along, index ? 0 : -Infinity), index < last ? part.length : Infinity);
      const away = Math.hypot(dx - t * part.ux, dy - t * part.uy);
      return { away, ahead_m: part.s + t, left_m: dy * part.ux - dx * part.uy, heading: Math.atan2(part.uy, part.ux) };
    });
    return places.reduce((best, place) => (place.away < best.away ? place : best));
  }

  /** Where an agent comes to with another place along or beside the lane, and how it turns with it. */
  move(agent, name, value) {
    const before = this.project(agent.x_m, agent.y_m);
    const [s, d] = name === "ahead_m" ? [value, before.left_m] : [before.ahead_m, value];
    const part = this.parts.findLast((part) => part.s <= s) ?? this.parts[0];
    const t = s - part.s;
    const [x, y] = [part.x + t * part.ux - d * part.uy, part.y + t * part.uy + d * part.ux];
    return { x, y, turn: Math.atan2(part.uy, part.ux) - before.heading };
  }
}
