// The page around the pictures: what it says, panels that open over the tools, dialogs.
export const at = (id) => document.getElementById(id);
export const given = JSON.parse(at("given").textContent);

// What the buttons of the form do.
export const ACTIONS = { left: "a", equal: "e", right: "b", both_miss: "both_miss" };

// A vote that waits for less needs no words.
const LATE_MS = 400;
const LAST = 5;
const { preferences } = given;
const { body } = document;
const all = (which) => document.querySelectorAll(which);

// A text of the page, its {} filled in order.
export function text(name, ...values) {
  const said = at("texts").content.querySelector(`[data-text="${name}"]`).textContent;
  return said.replaceAll("{}", () => values.shift());
}

const counted = (name, n) => text(`${name}-${n === 1 ? "one" : "many"}`, n);
const wordOf = ({ outcome, both_miss, strength }) => {
  const word = text(both_miss ? "both_miss" : outcome);
  return strength ? text(strength, word) : word;
};

// crypto.randomUUID is missing on plain http to another machine; this is as random.
export const freshKey = () => URL.createObjectURL(new Blob()).slice(-36);

// The polite region of those who hear the page.
export function say(what) {
  at("said").textContent = what;
}

// What somebody should notice, until the next vote.
export function note(what) {
  at("note").textContent = what;
  if (what) say(what);
}

// Lets a short tint of the style sheet run again; it has none where less motion is wanted.
export function replay(element) {
  for (const tint of element.getAnimations()) {
    tint.cancel();
    tint.play();
  }
}

const sides = document.querySelector(".sides");
const isLow = matchMedia("(max-width: 50rem), (max-height: 22rem)");
let ratio = 0;

// Side by side or one above the other, whichever shows more pixels a metre.
function lay() {
  // Where the page scrolls its pictures take what is left of a window.
  const high = isLow.matches ? innerHeight - 144 - at("ask").offsetHeight : sides.clientHeight;
  sides.classList.toggle("is-beside", sides.clientWidth / high > ratio);
}
addEventListener("resize", () => ratio && lay());

export function drawPair({ instruction, position, legend, unchanged = [], width, height }) {
  for (const mark of at("legend").children) mark.hidden = Boolean(legend) && !legend.includes(mark.dataset.mark);
  all(".same").forEach((same, side) => { same.hidden = !unchanged.includes("ab"[side]); });
  const { classList } = at("main");
  const isFirst = position <= given.first_pairs;
  if (ratio !== width / height || classList.contains("is-first") !== isFirst) {
    ratio = width / height;
    body.style.setProperty("--ratio", ratio);
    classList.toggle("is-first", isFirst);
    press("legend", at("legend").checkVisibility());
    lay();
  }
  at("instruction").textContent = instruction;
  document.title = document.title.replace(/\d+/, position);
}

const keysOfQuestions = Object.keys(given.questions);
const isOne = keysOfQuestions.length === 1;

// Which question of how many, where there are several.
const stepOf = (question) => text("step", keysOfQuestions.indexOf(question) + 1, keysOfQuestions.length);

export const asking = (question) => (isOne ? "" : `${stepOf(question)}. ${given.questions[question]}`);

// Whether somebody may add to Equal that both miss the instruction.
export const maybeNeither = (question) => question === "instruction";

export function drawQuestion(question, vote) {
  const changing = vote && text(vote.outcome === "skip" ? "changing-skip" : "changing", vote.position, wordOf(vote));
  const asks = given.questions[question];
  at("question").textContent = !vote ? asks : isOne ? changing : `${asks} ${changing}`;
  at("step").textContent = isOne ? "" : stepOf(question);
  for (const neither of all("[value=both_miss]")) neither.disabled = !maybeNeither(question);
  at("leave").hidden = !vote;
  const pressed = vote?.both_miss ? "both_miss" : vote?.outcome.toLowerCase();
  for (const button of all(".answers button")) {
    const isIt = pressed === ACTIONS[button.value] && (button.dataset.strength ?? "") === (vote.strength ?? "");
    button.ariaPressed = vote ? isIt : null;
  }
}

export function drawComment(comment) {
  at("vote").classList.toggle("is-written", comment.trim() !== "");
}

export function drawLens(lens) {
  const states = { original: lens.isFlipped, zoom: lens.isZoomed, "ruler-switch": lens.isRuling };
  for (const name of ["blink", "difference"]) states[`${name}-switch`] = lens.stands === name;
  for (const [name, isOn] of Object.entries(states)) at(name).ariaPressed = isOn;
  body.classList.toggle("shows-still", lens.isFlipped || lens.stands !== "");
  const said = lens.isFlipped ? text("original") : lens.reading || (lens.stands && text(lens.stands));
  for (const reading of all(".reading")) reading.textContent = said;
}

export function drawLast(votes) {
  const items = votes.slice(0, LAST).map((vote) => {
    const item = at("last-one").content.cloneNode(true);
    const [link] = item.querySelectorAll("a");
    link.dataset.vote = vote.key;
    link.ariaLabel = text("change", vote.position, wordOf(vote)) + (isOne ? "" : `. ${asking(vote.question)}`);
    link.children[0].textContent = vote.position;
    link.children[1].textContent = wordOf(vote);
    return item;
  });
  at("last").replaceChildren(...items);
}

let late = 0;

export function drawSaved(waiting, isCut) {
  const line = at("saved");
  const isOffline = isCut || !navigator.onLine;
  const tell = () => {
    line.textContent = isOffline ? text("offline", waiting) : waiting ? counted("waiting", waiting) : text("saved", given.saved);
    if (isOffline && !line.classList.contains("is-late")) say(line.textContent);
    line.classList.toggle("is-late", isOffline || waiting > 0);
  };
  clearTimeout(late);
  if (!waiting || isOffline || line.classList.contains("is-late")) tell();
  else late = setTimeout(tell, LATE_MS);
}

export function drawProgress({ saved, total, skipped }) {
  Object.assign(given, { saved, total });
  Object.assign(at("skipped"), { hidden: !skipped, textContent: text("skipped", skipped) });
  at("bar").value = saved;
  if (!at("saved").classList.contains("is-late")) drawSaved(0);
}

export function drawKeys() {
  body.classList.toggle("has-keys", preferences.single_keys);
  for (const hint of all("kbd[data-key]")) {
    hint.textContent = preferences.keys[hint.dataset.key][0].toUpperCase();
  }
}

export function press(name, isOn) {
  at(`${name}-switch`).ariaPressed = isOn;
  return isOn;
}

// What is asked for stands even where a low window has no room for it.
export function toggleLegend() {
  const { classList } = at("legend");
  const isOn = press("legend", !at("legend").checkVisibility());
  classList.toggle("is-hidden", !isOn);
  classList.toggle("is-asked", isOn);
  return isOn;
}

export const toggleRings = () => press("rings", !body.classList.toggle("has-no-rings"));

// --- Panels: tools, skip, report, comment, the account's menu -----------------------------------

export const openPop = () => document.querySelector(":popover-open, details[open]");

export function closePop() {
  const pop = openPop();
  if (pop?.popover) pop.hidePopover();
  else if (pop) pop.open = false;
}

export function showPop(name) {
  closePop();
  at(name).showPopover();
  at(name).querySelector("[data-first], button").focus();
}

// Digits choose, Esc and Ctrl+Enter leave; nothing votes.
export function keyInPop(event) {
  const isDone = event.key === "Escape" || (event.key === "Enter" && (event.ctrlKey || event.metaKey));
  const isTyping = event.target.matches("textarea");
  const chosen = isTyping ? null : openPop().querySelectorAll("[data-choice]")[event.key - 1];
  if (isDone) closePop();
  else if (!event.repeat) chosen?.click();
  if (isDone || chosen) event.preventDefault();
}

// The browser itself closes the others where somebody presses beside them.
addEventListener("pointerdown", ({ target }) => {
  if (openPop()?.matches("details") && !target.closest("details")) closePop();
});

// --- What has to be answered before voting goes on ----------------------------------------------

const gate = at("gate");
gate.addEventListener("cancel", (event) => event.preventDefault());

// Why: "elsewhere", or the status that the server answered with.
export function block(why, waiting, onward) {
  if (gate.open && gate.dataset.why === String(why)) return;
  gate.replaceChildren(at(`gate-${why}`).content.cloneNode(true));
  gate.dataset.why = why;
  const kept = gate.querySelector("[data-kept]");
  if (kept) kept.textContent = waiting ? counted(kept.dataset.kept, waiting) : "";
  gate.querySelector(".button").addEventListener("click", onward);
  if (!gate.open) gate.showModal();
}

export const unblock = () => gate.close();
