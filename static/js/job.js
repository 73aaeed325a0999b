// Asks every two seconds (ten while hidden) whether the job has moved; if so, shows the page anew.
const SHOWN_MS = 2000;
const HIDDEN_MS = 10000;
let etag = "";

function live() {
  return document.getElementById("live");
}

async function showAnew() {
  const answer = await fetch(location.href, { credentials: "same-origin" });
  if (!answer.ok || answer.redirected) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.getElementById("live");
  if (!fresh) return;
  for (const old of live().querySelectorAll("details[id]")) {
    const same = fresh.querySelector(`#${CSS.escape(old.id)}`);
    if (same) same.open = old.open;
  }
  const focused = live().contains(document.activeElement) ? document.activeElement.id : "";
  live().replaceWith(document.adoptNode(fresh));
  if (focused) document.getElementById(focused)?.focus();
}

async function ask() {
  const answer = await fetch(live().dataset.progress, {
    credentials: "same-origin",
    headers: etag ? { "If-None-Match": etag } : {},
  });
  if (answer.status === 304) return false;
  if (!answer.ok) throw new Error(`progress answered ${answer.status}`);
  const isFirst = etag === "";
  const progress = await answer.json();
  etag = answer.headers.get("ETag") ?? "";
  if (!isFirst || progress.is_over) await showAnew();
  if (progress.is_over) {
    const isStopped = progress.settled < progress.total;
    const said = document.getElementById("said");
    said.textContent = isStopped
      ? said.dataset.stopped.replace("{}", progress.settled)
      : said.dataset.all;
  }
  return progress.is_over;
}

async function loop() {
  try {
    if (await ask()) return;
  } catch {
    // The network may be back at the next turn.
  }
  setTimeout(loop, document.hidden ? HIDDEN_MS : SHOWN_MS);
}

loop();
