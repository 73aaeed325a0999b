// One's own pace, for nobody else, and a word about a pause after long work.
import { at, given, say, text } from "./vote-page.js";

const PAUSE_VOTES = 40;
const PAUSE_MS = 25 * 60_000;
// Who was away for so long has had one.
const AWAY_MS = 3 * 60_000;
const { today } = given;
let [since, last, votes] = [Date.now(), Date.now(), 0];

export function rest() {
  [since, last, votes] = [Date.now(), Date.now(), 0];
  at("pause").hidden = true;
}

// After each new vote: how long its pair was seen.
export function count(ms) {
  if (Date.now() - last > AWAY_MS) rest();
  today.push(ms);
  votes += 1;
  last = Date.now();
  const minutes = Math.round((last - since) / 60_000);
  if (!at("pause").hidden || (votes < PAUSE_VOTES && last - since < PAUSE_MS)) return;
  at("pause").hidden = false;
  at("pause").firstElementChild.textContent = text("pause", votes, minutes);
  say(text("pause", votes, minutes));
}

export function drawPace() {
  const seen = today.filter(Number).sort((one, other) => one - other);
  const middle = (seen[(seen.length - 1) >> 1] + seen[seen.length >> 1]) / 2;
  at("pace").textContent = seen.length ? text("pace", today.length, Math.round(middle / 1000)) : "";
}
