// Shows a part of the page anew every second (ten while hidden) for as long as it moves.
const SHOWN_MS = 1000;
const HIDDEN_MS = 10000;

async function showAnew() {
  const answer = await fetch(location.href, { credentials: "same-origin" });
  if (!answer.ok || answer.redirected) return true;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.getElementById("live");
  if (!fresh) return false;
  document.getElementById("live").replaceWith(document.adoptNode(fresh));
  return "live" in fresh.dataset;
}

async function loop() {
  try {
    if (!(await showAnew())) return;
  } catch {
    // The network may be back at the next turn.
  }
  setTimeout(loop, document.hidden ? HIDDEN_MS : SHOWN_MS);
}

setTimeout(loop, SHOWN_MS);
