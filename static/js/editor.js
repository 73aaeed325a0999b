// Placing objects by hand: mouse, touch and keys on the picture, numbers beside it. The server
// checks every change; it puts agents on the centreline and says on which lane they are.
import { Lane } from "./editor-lane.js";
import { makeSentence } from "./editor-sentence.js";
import { Edit } from "./editor-state.js";
import { Stage } from "./editor-view.js";

const form = document.getElementById("edit");
const words = form.dataset;
const field = form.elements.modification;
const read = (id) => JSON.parse(document.getElementById(id).textContent);
const scene = read("scene");
const placed = form.querySelector("#placed");
const keep = form.elements.keep_traffic;
const edit = new Edit(scene, parsed(field.value));
const svg = form.querySelector("svg.stage");
const stage = new Stage(svg, scene, words.picture, [...edit.change.add, ...edit.change.move]);
const lane = new Lane(scene.route);
const numbers = form.querySelector("[data-numbers]");
const list = form.querySelector("[data-list]");
const findings = form.querySelector("[data-findings]");
const showSentence = makeSentence(form);
const degrees = 180 / Math.PI;
let armed = false;
let isDirty = false;
let requests = 0;
let timer = 0;

// Null for what is no JSON.
function parsed(text) {
  try {
    return JSON.parse(text || "{}");
  } catch {
    return null;
  }
}

function keepsTraffic() {
  return keep ? keep.checked : words.keep !== "";
}

function showTraffic() {
  scene.agents = keepsTraffic() ? scene.recorded : scene.cleared;
}

// --- Showing ------------------------------------------------------------------------------------

function show() {
  stage.draw(edit);
  const rows = edit.everyone().filter(([agent, was]) => was !== "kept" || agent.id === edit.selected);
  showList(rows);
  form.querySelector("[data-empty]").hidden = rows.length > 0;
  form.querySelector("[data-undo]").disabled = !edit.past.length;
  form.querySelector("[data-redo]").disabled = !edit.future.length;
  showNumbers();
}

// Entries stay in their places: one that is pressed while a number is taken over is pressed still.
function showList(rows) {
  while (list.children.length > rows.length) list.lastChild.remove();
  while (list.children.length < rows.length) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "button";
    list.appendChild(document.createElement("li")).append(button);
  }
  rows.forEach(([agent, was], index) => {
    const button = list.children[index].firstChild;
    const kind = [...placed.options].find(({ value }) => value === agent.type)?.textContent ?? agent.type;
    button.dataset.pick = agent.id;
    button.setAttribute("aria-pressed", String(agent.id === edit.selected));
    button.textContent = `${agent.id} · ${kind} · ${words[was]}`;
  });
}

function showNumbers() {
  const [agent, was] = edit.find(edit.selected);
  numbers.hidden = !agent;
  if (!agent) return;
  numbers.querySelector("[data-name]").textContent = agent.id;
  for (const name of ["restore", "remove"]) {
    const isGone = was === "removed";
    numbers.querySelector(`[data-do=${name}]`).hidden = name === "restore" ? was !== "moved" && !isGone : isGone;
  }
  for (const input of numbers.querySelectorAll("[data-field]")) {
    input.disabled = was === "removed";
    const isTyped = document.activeElement === input && input.dataset.field !== "preset";
    if (!isTyped) input.value = shown(agent, input.dataset.field);
  }
  const preset = scene.presets[shown(agent, "preset")];
  for (const name of ["within_m", "number"]) numberOf(name).closest(".field").hidden = !preset;
  if (preset) numberOf("number").labels[0].textContent = preset.number;
}

function numberOf(name) {
  return numbers.querySelector(`[data-field=${name}]`);
}

// A field of an agent as its input has it.
function shown(agent, name) {
  const [walk_x_m, walk_y_m] = agent.walk_to_m ?? [];
  const wish = (agent.motion && edit.presets[agent.id]) ?? { preset: agent.motion ? "own" : "" };
  const place = { ...lane.project(agent.x_m, agent.y_m), heading_deg: agent.heading_rad * degrees };
  const value = { ...agent, ...place, walk_x_m, walk_y_m, ...wish }[name];
  return typeof value === "number" ? String(Math.round(value * 1000) / 1000) : (value ?? "");
}

// --- Changing -----------------------------------------------------------------------------------

function written() {
  return JSON.stringify(edit.document, null, 2);
}

// What is on the picture now is what is sent.
function take() {
  isDirty = true;
  field.value = written();
  show();
}

function changed() {
  take();
  requests += 1; // what is under way is about what was before
  clearTimeout(timer);
  timer = setTimeout(() => check().catch(fail), 250);
}

// What the server makes of it; with an id, that agent on the nearest centreline; with a preset,
// whoever it names moves so.
async function check(snapped = "", modification = edit.document, preset = null) {
  clearTimeout(timer);
  const mine = ++requests;
  const answer = await fetch(words.check, {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-CSRFToken": form.elements.csrfmiddlewaretoken.value },
    body: JSON.stringify({
      modification,
      snap: snapped,
      preset,
      scenario: words.scenario,
      keep_traffic: keepsTraffic(),
      derives: form.elements.derives?.checked ?? false,
      type: form.elements.type?.value || form.elements.own_type?.value || "",
    }),
  });
  if (mine !== requests) return;
  if (!answer.ok) throw new Error(String(answer.status));
  const reply = await answer.json();
  if (mine !== requests) return;
  if (reply.modification) Object.assign(edit, { presets: reply.presets ?? {}, ways: reply.ways ?? {} });
  if ((snapped || preset) && reply.modification) {
    edit.begin();
    edit.change = Edit.read(reply.modification);
    take();
  } else show();
  tell(reply);
}

function tell(answer) {
  const lines = answer.problem ? [{ severity: "wrong", label: words.wrong, sentence: answer.problem }] : answer.lines;
  const items = lines.map(({ severity, label, sentence }) => {
    const item = document.createElement("li");
    const badge = document.createElement("span");
    badge.className = `badge is-${{ wrong: "bad", doubtful: "warn" }[severity] ?? "quiet"}`;
    badge.textContent = label;
    item.append(badge, ` ${sentence}`);
    return item;
  });
  findings.replaceChildren(...items);
  form.querySelector("[data-fine]").hidden = Boolean(answer.problem) || lines.some((line) => line.severity !== "fact");
  if (answer.statements) showAsked(answer);
}

// What the drawing asks for, and the sentence that it makes, until somebody types another.
function showAsked({ sentence, statements }) {
  const asks = form.querySelector("[data-asks]");
  if (!asks) return;
  asks.hidden = statements.length === 0;
  asks.querySelector("[data-statements]").replaceChildren(
    ...statements.map((text) => Object.assign(document.createElement("li"), { textContent: text })),
  );
  showSentence(sentence);
}

function fail() {
  tell({ problem: words.failed, lines: [] });
}

// A preset that was chosen has its usual numbers.
function move(agent_id, isNew) {
  const read = (name) => (isNew || numberOf(name).value === "" ? null : Number(numberOf(name).value));
  const preset = numberOf("preset").value || null;
  const wish = { agent_id, preset, within_m: read("within_m"), number: read("number") };
  return check("", edit.document, wish).catch(fail);
}

function act(what) {
  const id = edit.selected;
  if (what === "undo" ? edit.undo() : what === "redo" ? edit.redo() : true) {
    if (what === "remove" && id) edit.remove(id);
    if (what === "restore" && id) edit.restore(id);
    if (what === "copy" && id) edit.copy(id);
    if (what === "snap") return id ? check(id).catch(fail) : undefined;
    if (what === "ahead") edit.add(placed.value, ...scene.ahead);
    changed();
  }
  return undefined;
}

function arm(on) {
  armed = on;
  form.querySelector("[data-arm]").setAttribute("aria-pressed", String(on));
  svg.classList.toggle("is-armed", on);
}

// --- Mouse and touch ----------------------------------------------------------------------------

let drag = null;

svg.addEventListener("pointerdown", (event) => {
  if (event.button) return;
  const at = stage.at(event);
  const handle = event.target.closest("[data-handle]")?.dataset.handle;
  const id = event.target.closest("[data-agent]")?.dataset.agent;
  if (armed) {
    edit.add(placed.value, round(at.x), round(-at.y));
    arm(false);
    changed();
    return;
  }
  svg.setPointerCapture(event.pointerId);
  if (handle) drag = { what: handle, id: edit.selected, isNew: true };
  else if (id) {
    edit.selected = id;
    const [agent, was] = edit.find(id);
    drag = was === "removed" ? null : { what: "move", id, dx: agent.x_m - at.x, dy: agent.y_m + at.y, isNew: true, x: at.x, y: at.y };
    show();
  } else drag = { what: "pan", x: event.clientX, y: event.clientY };
});

svg.addEventListener("pointermove", (event) => {
  if (!drag) return;
  const at = stage.at(event);
  if (drag.what === "pan") {
    stage.pan((drag.x - event.clientX) * stage.unit, (drag.y - event.clientY) * stage.unit);
    [drag.x, drag.y] = [event.clientX, event.clientY];
    return;
  }
  // A press that trembles is no drag.
  if (drag.isNew && drag.what === "move" && Math.hypot(at.x - drag.x, at.y - drag.y) < 4 * stage.unit) return;
  if (drag.isNew) edit.begin();
  drag.isNew = false;
  const [agent] = edit.find(drag.id);
  if (drag.what === "move") edit.shift(drag.id, round(at.x + drag.dx), round(drag.dy - at.y));
  if (drag.what === "turn") edit.set(drag.id, { heading_rad: Math.atan2(-at.y - agent.y_m, at.x - agent.x_m) });
  if (drag.what === "walk") edit.walk(drag.id, [round(at.x), round(-at.y)]);
  show();
});

for (const name of ["pointerup", "pointercancel"]) {
  svg.addEventListener(name, () => {
    const moved = drag && drag.what !== "pan" && !drag.isNew;
    drag = null;
    if (moved) changed();
    else show();
  });
}

svg.addEventListener("wheel", (event) => {
  event.preventDefault();
  stage.zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15, stage.at(event));
  stage.draw(edit);
}, { passive: false });

function round(value) {
  return Math.round(value * 100) / 100;
}

// --- Keys and numbers ---------------------------------------------------------------------------

svg.addEventListener("keydown", (event) => {
  const far = event.shiftKey ? 1 : 0.1;
  const steps = { ArrowUp: [0, far], ArrowDown: [0, -far], ArrowLeft: [-far, 0], ArrowRight: [far, 0] };
  const [agent, was] = edit.find(edit.selected);
  const turn = { "[": 5, "]": -5, "{": 1, "}": -1 }[event.key];
  if (event.key === "Escape") {
    arm(false);
    edit.selected = null;
    show();
  } else if (event.key === "+" || event.key === "-") {
    stage.zoom(event.key === "+" ? 0.8 : 1.25);
    stage.draw(edit);
  } else if (!agent || was === "removed" || event.ctrlKey || event.metaKey) return;
  else if (steps[event.key]) {
    edit.begin();
    edit.shift(agent.id, round(agent.x_m + steps[event.key][0]), round(agent.y_m + steps[event.key][1]));
    changed();
  } else if (turn) {
    edit.begin();
    edit.set(agent.id, { heading_rad: agent.heading_rad + turn / degrees });
    changed();
  } else if (event.key === "Delete" || event.key === "Backspace") act("remove");
  else if (event.key === "s") act("snap");
  else return;
  event.preventDefault();
});

form.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target.matches("input, textarea")) return;
  if (event.key !== "z" && event.key !== "y") return;
  event.preventDefault();
  act(event.key === "y" || event.shiftKey ? "redo" : "undo");
});

numbers.addEventListener("change", (event) => {
  const input = event.target.closest("[data-field]");
  const [agent] = edit.find(edit.selected);
  if (!input || !agent) return;
  const name = input.dataset.field;
  if (input.value === shown(agent, name)) return undefined;
  if (["preset", "within_m", "number"].includes(name)) return move(agent.id, name === "preset");
  const value = name === "type" ? input.value : input.value === "" ? undefined : Number(input.value);
  if (Number.isNaN(value) || (value === undefined && !name.startsWith("walk"))) return show();
  edit.begin();
  if (name === "heading_deg") edit.set(agent.id, { heading_rad: value / degrees });
  else if (name === "type") edit.set(agent.id, { type: value, ...scene.sizes[value] });
  else if (name.startsWith("walk")) {
    const [x, y] = agent.walk_to_m ?? [agent.x_m, agent.y_m];
    const walk = name === "walk_x_m" ? [value, y] : [x, value];
    edit.walk(agent.id, value === undefined ? undefined : walk);
  } else if (name === "ahead_m" || name === "left_m") {
    const { x, y, turn } = lane.move(agent, name, value);
    edit.shift(agent.id, round(x), round(y));
    edit.set(agent.id, { heading_rad: agent.heading_rad + turn });
  } else if (name === "x_m" || name === "y_m") {
    edit.shift(agent.id, name === "x_m" ? value : agent.x_m, name === "y_m" ? value : agent.y_m);
  } else edit.set(agent.id, { [name]: value });
  return changed();
});

// Enter in a number takes the number over; it does not save the page.
numbers.addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !event.target.matches("[data-field]")) return;
  event.preventDefault();
  event.target.dispatchEvent(new Event("change", { bubbles: true }));
});

form.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  const { pick, zoom } = button.dataset;
  if (pick) {
    edit.selected = pick;
    show();
    svg.focus({ preventScroll: true });
  } else if (button.dataset.do) act(button.dataset.do);
  else if (zoom) {
    if (zoom === "all") stage.show(stage.whole);
    else stage.zoom(Number(zoom));
    stage.draw(edit);
  } else if (button.matches("[data-arm]")) arm(!armed);
});

for (const name of ["keep_traffic", "derives", "type", "own_type"]) {
  form.elements[name]?.addEventListener("change", () => {
    showTraffic();
    changed();
  });
}

field.addEventListener("change", () => {
  const typed = parsed(field.value);
  if (typed === null) return tell({ problem: words.nojson, lines: [] });
  const change = Edit.read(typed);
  if (!change) return check("", typed).catch(fail);
  edit.begin();
  edit.change = change;
  edit.selected = null;
  return changed();
});

form.addEventListener("submit", () => {
  isDirty = false;
});
addEventListener("beforeunload", (event) => {
  if (isDirty) event.preventDefault();
});
new ResizeObserver(() => {
  const [x, y, width, height] = stage.box;
  const seen = (width * svg.clientHeight) / (svg.clientWidth || 1);
  stage.show([x, y + (height - seen) / 2, width, seen]);
  stage.draw(edit);
}).observe(svg);

form.classList.add("is-live");
field.value ||= written(); // what was refused stands there to be mended
showTraffic();
show();
check().catch(fail);
