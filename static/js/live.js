// Shows the part of a page that waits for workers anew for as long as it waits. The page is not
// loaded for it, so what somebody types or sends meanwhile is not lost.
const SHOWN_MS = 1000;
const HIDDEN_MS = 10000;
/** A page that takes long to answer is asked less often. */
const PAUSE_PER_ANSWER = 5;
/** Tags of the progress that the page shows, and of the newest that is known. */
let shown = "";
let newest = "";
let isTouched = false;

function live() {
  return document.getElementById("live");
}

/** Whether anything is new; a page that names no shorter answer has to be asked itself. */
async function hasMoved() {
  if (!live().dataset.progress) return true;
  const answer = await fetch(live().dataset.progress, {
    headers: shown ? { "If-None-Match": shown } : {},
  });
  if (answer.status === 304) return false;
  if (!answer.ok) throw new Error(`progress answered ${answer.status}`);
  const progress = await answer.json();
  newest = answer.headers.get("ETag") ?? "";
  if (progress.is_over) {
    const announcement = document.getElementById("said");
    announcement.textContent =
      progress.settled < progress.total
        ? announcement.dataset.stopped.replace("{}", progress.settled)
        : announcement.dataset.all;
  }
  const isFirst = shown === "";
  if (isFirst) shown = newest;
  return !isFirst || progress.is_over;
}

function replace(old, fresh) {
  for (const details of old.querySelectorAll("details[id]")) {
    const same = fresh.querySelector(`#${CSS.escape(details.id)}`);
    if (same) same.open = details.open;
  }
  for (const input of old.querySelectorAll("input[id]")) {
    const same = fresh.querySelector(`#${CSS.escape(input.id)}`);
    if (same && input.value !== input.defaultValue) same.value = input.value;
  }
  const focused = old.contains(document.activeElement) ? document.activeElement.id : "";
  // What is as it was stays: pictures would load anew.
  if (!fresh.isEqualNode(old)) old.replaceWith(document.adoptNode(fresh));
  shown = newest;
  if (focused) document.getElementById(focused)?.focus();
}

/** Returns whether there is nothing more to wait for. */
async function showAnew() {
  const answer = await fetch(location.href, { headers: { "X-Looks-Again": "1" } });
  if (!answer.ok) throw new Error(`the page answered ${answer.status}`);
  if (answer.redirected) {
    if (!isTouched) location.replace(answer.url);
    return true;
  }
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.getElementById("live");
  const isOver = !fresh || !("live" in fresh.dataset);
  if (isOver) {
    // "It is launched" is no news beside what came of it.
    for (const list of document.querySelectorAll(".messages")) {
      for (const line of list.querySelectorAll("li:not(.is-bad)")) line.remove();
      if (!list.children.length) list.parentNode.remove();
    }
  }
  if (isOver && "reload" in live().dataset && !isTouched) location.reload();
  else if (fresh && !document.activeElement.matches("#live :is(input, select, textarea)")) {
    replace(live(), fresh);
  } else return false;
  return isOver;
}

async function loop() {
  const startedAt = performance.now();
  try {
    if ((await hasMoved()) && (await showAnew())) return;
  } catch {
    // The network may be back at the next turn.
  }
  const took = performance.now() - startedAt;
  setTimeout(loop, Math.max(document.hidden ? HIDDEN_MS : SHOWN_MS, PAUSE_PER_ANSWER * took));
}

for (const name of ["input", "submit"]) addEventListener(name, () => { isTouched = true; });
setTimeout(loop, SHOWN_MS);
