// The voting loop: pairs are decoded ahead; a vote is written down in the browser, the next pair
// is painted, and the vote goes out in the background. A pair stays until its last question is
// answered.
import { filmActions, roll } from "./vote-film.js";
import { actionOf } from "./vote-keys.js";
import { Lens } from "./vote-lens.js";
import { ask, Outbox } from "./vote-outbox.js";
import { count, drawPace, rest } from "./vote-pace.js";
import * as page from "./vote-page.js";
import { Pairs } from "./vote-pairs.js";
import { hold } from "./vote-tabs.js";

// The second half of a double press must not judge the next pair.
const BOUNCE_MS = 200;

const { at, given, text } = page;
const { preferences, undoable, urls } = given;
const questions = Object.keys(given.questions);
const form = at("vote");
const field = form.elements.comment;
// The votes, the latest first: {key, position, question, outcome, both_miss, strength, comment,
// shown, pair}; the one of them whose pair is on the screen again; the pair that is judged, the one
// whose pictures are painted, since when, and what is asked about it: a vote to change, or a question.
let votes = given.last;
let review = null;
let onScreen = null;
let painted = null;
let shownAt = 0;
let asked = null;
let paintedAt = Infinity;
let hiddenMs = 0;
let isLeaving = false;

const pairs = new Pairs(given.alts, fetchPairs, draw);
const lens = new Lens([...document.querySelectorAll(".panel")], text, page.drawLens, given.rings);
const why = given.ask_why && new (await import("./vote-why.js")).Why(lens);
const outbox = new Outbox(given.outbox, urls, {
  wanted: () => Math.min(12, pairs.depth + outbox.entries.length),
  changed: () => page.drawSaved(outbox.entries.length, outbox.isCut),
  saved,
  refused,
  stopped,
});

// --- Questions -----------------------------------------------------------------------------------

const question = () => review?.question ?? onScreen.shown.question;
const votesOn = ({ matchup }) => votes.filter(({ shown }) => shown.matchup === matchup);
const isSkipped = (shown) => votesOn(shown).some(({ outcome }) => outcome === "skip");

// What is asked next of a pair, from the question that its server knows of; undefined when done.
function nextOf(shown) {
  if (isSkipped(shown)) return undefined;
  const answered = votesOn(shown).map((vote) => vote.question);
  return questions.slice(questions.indexOf(shown.question)).find((key) => !answered.includes(key));
}

// Answers that wait here may be ahead of what the server says.
function caughtUp(shownOnes) {
  for (const shown of shownOnes) shown.question = nextOf(shown) ?? shown.question;
  return shownOnes;
}

// Of a pair that was skipped only the skip can be changed; other answers wait behind it.
const changeable = () =>
  votes.filter(({ question: key, shown }) => key === questions[0] || !isSkipped(shown)).slice(0, undoable);

// --- Painting ------------------------------------------------------------------------------------

function draw() {
  const pair = review ? review.pair : pairs.open;
  const { state = "loading" } = pair ?? {};
  if (pair) at("place").textContent = pair.shown.position;
  const isReady = state === "ready";
  at("main").classList.toggle("is-waiting", !isReady);
  at("answers").inert = !isReady;
  form.inert = state === "loading";
  if (isReady) {
    if (pair !== painted || asked !== (review ?? pair.shown.question)) paint(pair);
    return;
  }
  // What does not show can be skipped.
  onScreen = form.inert ? null : pair;
  painted = null;
  at("veil-text").textContent = text(state);
  at("again").hidden = form.inert;
  if (!pair) finish();
}

// Another question about the same pair leaves pictures and tools as they are.
function paint(pair) {
  const isNew = pair !== painted;
  onScreen = painted = pair;
  asked = review ?? pair.shown.question;
  paintedAt = Infinity;
  if (isNew) {
    page.drawPair(pair.shown);
    lens.show(pair, preferences.keep_zoom);
    roll(pair, lens.scenes, () => pair === painted);
    form.dataset.matchup = pair.shown.matchup;
    form.elements.report_side.value = "both";
  }
  if (why) why.show(review?.faults ?? []);
  page.drawQuestion(question(), review);
  if (!isNew) page.say(page.asking(question()));
  field.value = (review ? review.comment : pair.draft) ?? "";
  page.drawComment(field.value);
  requestAnimationFrame(() => {
    paintedAt = performance.now();
    if (isNew) [shownAt, hiddenMs] = [paintedAt, 0];
    setTimeout(afterwards);
  });
}

// What need not be in the same frame.
function afterwards() {
  page.replay(at("ask"));
  page.drawLast(changeable());
  drawPace();
  const coming = pairs.list[review ? 0 : 1];
  coming?.warm();
  // A phone that is held upright shows a part of the picture: that with the change.
  if (coming?.originals && upright.matches) compared(({ changeOf }) => changeOf(coming).catch(() => null));
}

// --- Deciding ------------------------------------------------------------------------------------

function decide(outcome, more = {}) {
  if (!onScreen || (outcome !== "skip" && onScreen.state !== "ready")) return;
  const now = performance.now();
  if (!(now - paintedAt >= BOUNCE_MS)) return page.replay(at("saved"));
  const { shown } = onScreen;
  const [key, comment] = [page.freshKey(), field.value.trim()];
  // A skip is of the whole pair, whatever was asked last.
  const body = { key, matchup: shown.matchup, question: outcome === "skip" ? questions[0] : question() };
  const faults = why && outcome !== "skip" ? why.marks : [];
  Object.assign(body, { outcome, comment, faults, aids: [...given.aids, ...lens.aids], ms_visible: Math.round(now - shownAt - hiddenMs), ...more });
  const vote = voteOf({ body, shown }, onScreen);
  const old = [review, ...votesOn(shown)].find((one) => one?.question === body.question);
  page.note("");
  page.closePop();
  if (old) {
    const said = (one) => JSON.stringify(["outcome", "both_miss", "strength", "comment", "faults"].map((name) => one[name]));
    if (said(vote) === said(old) && outcome !== "skip") return leave();
    body.supersedes = old.key;
    Object.assign(old, vote);
  } else {
    votes = [vote, ...votes];
  }
  if (!review) onScreen.draft = "";
  const next = settle(onScreen);
  if (!review && !next) setTimeout(count, 0, body.ms_visible);
  review = null;
  outbox.add("votes", body, shown);
  draw();
}

// The next question takes the place of the last one; without one the pair is done.
function settle(pair) {
  const next = nextOf(pair.shown);
  if (next) pairs.keep(pair, next);
  else pairs.decide(pair.shown.matchup);
  return next;
}

const voteOf = ({ body, shown }, pair) => (
  { question: questions[0], both_miss: false, strength: "", faults: [], ...body, position: shown.position, shown, pair }
);

function undo(vote) {
  const earlier = changeable();
  vote ??= earlier[review ? earlier.indexOf(review) + 1 : 0];
  if (!vote) return page.note(text("no-more"));
  if (onScreen && !review) onScreen.draft = field.value;
  page.closePop();
  if (vote.pair?.state !== "ready") vote.pair = pairs.held(vote.shown) ?? pairs.make(vote.shown);
  review = vote;
  draw();
}

function leave() {
  lens.flip(false);
  if (!at("pause").hidden) rest();
  if (!review) return;
  review = null;
  draw();
}

// On a pair that was answered the mark goes out at once, the answer as it was.
function markFault(fault) {
  why.mark(fault);
  page.closePop();
  if (!review || review.outcome === "skip") return;
  const { outcome, both_miss, strength, aids, ms_visible } = review;
  decide(outcome, { both_miss, strength, aids, ms_visible });
}

function report(reason) {
  const { report_comment: told, report_side: side } = form.elements;
  const { matchup } = onScreen.shown;
  outbox.add("reports", { key: page.freshKey(), matchup, reason, side: side.value, comment: told.value.trim() });
  told.value = "";
  page.closePop();
}

// --- What the server says ------------------------------------------------------------------------

function saved({ to }, body) {
  page.unblock();
  if (to === "reports") return page.note(text("reported"));
  page.drawProgress(body);
  pairs.take(caughtUp(body.next));
  if (onScreen && !review && !outbox.entries.length && question() === questions[0]) {
    const { position, instruction } = onScreen.shown;
    page.say(`${text("spoken", position, given.total, instruction)} ${page.asking(question())}`.trim());
  }
}

function refused({ to, body: vote }, status, answer) {
  if (to === "reports") return page.note(text("report-refused"));
  const stored = answer?.error?.outcome;
  if (stored === vote.outcome) return;
  if (stored) page.note(text("first-counts", text(stored)));
  else page.note(text(status === 404 ? "taken-back" : "not-accepted"));
  if (review?.key === vote.key) leave();
  votes = votes.filter(({ key }) => key !== vote.key);
  if (!stored && status !== 404) pairs.reopen(vote);
  page.drawLast(changeable());
  pairs.fill();
}

function stopped(status) {
  page.block(status, outbox.entries.length, () => {
    isLeaving = true;
    if (status !== 410) return;
    outbox.clear();
    location.replace(urls.page);
  });
}

async function fetchPairs(n) {
  const { status, body } = await ask(`${urls.matchups}&n=${n}`);
  if (outbox.isHalted) return null;
  if ([401, 403, 410].includes(status)) stopped(status);
  if (status !== 200) return status === 409 ? [] : null; // the page says that they are drawn
  page.unblock();
  return caughtUp(body);
}

// No pair is left here; the server knows whether that is all.
async function finish() {
  if (outbox.entries.length || isLeaving) return;
  const found = await pairs.fill();
  if (found?.length !== 0 || pairs.open || review || outbox.entries.length) return;
  isLeaving = true;
  location.replace(urls.page);
}

// --- Keys, clicks, tabs --------------------------------------------------------------------------

// How clear it is, where the study asks for it.
const prefer = (outcome, strength) => decide(outcome, given.ask_strength ? { strength } : {});
const upright = matchMedia("(max-width: 50rem) and (orientation: portrait)");

const actions = {
  a: () => prefer("A", "slightly"),
  e: () => decide("E"),
  b: () => prefer("B", "slightly"),
  a_clearly: () => given.ask_strength && prefer("A", "clearly"),
  b_clearly: () => given.ask_strength && prefer("B", "clearly"),
  both_miss: () => given.allow_both_miss && page.maybeNeither(question()) && decide("E", { both_miss: true }),
  undo: () => undo(),
  ...Object.fromEntries(["skip", "report", "comment", "tools"].map((name) => [name, () => page.showPop(name)])),
  why: () => why && onScreen?.state === "ready" && why.next(),
  rest,
  leave,
  original: () => lens.flip(true),
  pin: () => lens.flip(!lens.isFlipped, true),
  zoom: () => (lens.isZoomed ? lens.toggleZoom() : compared(({ changeOf }) => zoom(changeOf))),
  reset: () => lens.reset(),
  ruler: () => lens.rule(true),
  replay: () => late(import("./vote-replay.js"), ({ toggleReplay }) => toggleReplay(lens.aids)),
  ...filmActions,
  blink: () => compare("blink", true),
  difference: () => compare("difference"),
  rings: () => given.rings && ask(urls.preferences, { rings: page.toggleRings() }),
  legend: () => ask(urls.preferences, { legend: page.toggleLegend() }),
  help: () => late(import("./vote-help.js"), ({ showHelp }) => showHelp()),
  again: () => pairs.fill(),
  close: page.closePop,
};
// What is loaded when it is asked for first.
const late = (module, use) => module.then(use, () => page.note(text("unreachable")));
// What stands in the panels, true or false; without it the other way round.
const compared = (use) => late(import("./vote-compare.js"), use);
const compare = (...how) => compared(({ show }) => show(lens, ...how));

async function zoom(changeOf) {
  const pair = onScreen;
  const change = await changeOf(pair).catch(() => null);
  if (pair === onScreen) lens.toggleZoom(change);
}

// Actions that go without a pair as well; key codes and what their release ends.
const always = new Set(["undo", "leave", "tools", "rings", "legend", "help", "again"]);
const held = new Map();

addEventListener("keydown", (event) => {
  const { target, repeat, code } = event;
  if (document.querySelector("dialog[open]")) return;
  const pop = page.openPop();
  // The tools show which key does what; any of them may be pressed.
  if (pop && !(pop.id === "why" && actionOf(event, preferences) === "why") && (pop.id !== "tools" || event.key === "Escape")) return page.keyInPop(event);
  if (onScreen && lens.arrow(event)) return event.preventDefault();
  const action = actionOf(event, preferences);
  // Enter, held on a button, would click on and on.
  if (action || (repeat && target.closest("button"))) event.preventDefault();
  if (!action || repeat || (!onScreen && !always.has(action))) return;
  page.closePop();
  if (pop && action === "tools") return;
  actions[action]();
  if (action === "original") held.set(code, () => lens.isPinned || lens.flip(false));
  if (action === "blink") held.set(code, () => compare("blink", false));
  if (action === "ruler") held.set(code, () => lens.rule(false));
});

function release(code) {
  held.get(code)?.();
  held.delete(code);
}

addEventListener("keyup", ({ code }) => release(code));
addEventListener("blur", () => [...held.keys()].forEach(release));

form.addEventListener("submit", (event) => {
  event.preventDefault();
  const { name, value, dataset } = event.submitter ?? {};
  if (name === "skip") decide("skip", { reason: value });
  else if (name === "report") report(value);
  else if (name === "why") markFault(value);
  else actions[page.ACTIONS[value] + (dataset?.strength === "clearly" ? "_clearly" : "")]?.();
});
form.addEventListener("input", () => page.drawComment(field.value));

document.addEventListener("click", (event) => {
  const pressed = event.target.closest("[data-do], [data-vote]");
  if (!pressed) return;
  event.preventDefault();
  if (pressed.closest("#tools")) page.closePop();
  const { do: action, vote: key } = pressed.dataset;
  if (key) undo(votes.find((vote) => vote.key === key));
  else if (action === "ruler") lens.rule(!lens.isRuling);
  else if (action === "blink") compare("blink");
  else actions[action === "original" ? "pin" : action]();
});

document.addEventListener("visibilitychange", () => {
  hiddenMs += document.hidden ? -performance.now() : performance.now();
});
addEventListener("beforeunload", (event) => {
  if (outbox.entries.length && !isLeaving) event.preventDefault();
});
addEventListener("offline", () => page.drawSaved(outbox.entries.length));
// A page that comes back from the browser's memory may show a pair that is decided already.
addEventListener("pageshow", ({ persisted }) => persisted && location.reload());

function elsewhere() {
  outbox.halt();
  // The other tab sends what is kept.
  isLeaving = true;
  page.block("elsewhere", 0, async () => {
    await hold(given.outbox, () => {}, { steal: true });
    location.reload();
  });
}

async function start() {
  form.inert = true;
  page.drawKeys();
  page.press("legend", at("legend").checkVisibility());
  if (!preferences.rings) document.body.classList.add("has-no-rings");
  // On small windows both pictures keep in sight beside it.
  const { classList, style } = document.body;
  new ResizeObserver(() => style.setProperty("--ask", `${at("ask").offsetHeight}px`)).observe(at("ask"));
  classList.add("is-live");
  if (!(await hold(given.outbox, elsewhere))) return elsewhere();
  const waiting = outbox.entries.filter(({ to }) => to === "votes").map((entry) => voteOf(entry));
  const keyOf = ({ shown, question: key }) => `${shown.matchup} ${key}`;
  const cast = new Map([...votes.reverse(), ...waiting].map((vote) => [keyOf(vote), vote]));
  votes = [...cast.values()].reverse();
  for (const { shown } of votes) if (!nextOf(shown)) pairs.decide(shown.matchup);
  page.drawSaved(outbox.entries.length);
  page.drawLast(changeable());
  pairs.take(caughtUp(given.pairs));
  outbox.start();
  const { change } = given;
  if (change) undo(cast.get(keyOf(change)));
}

start();
