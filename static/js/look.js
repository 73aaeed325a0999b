// The pictures come when a worker has drawn them; what is typed meanwhile stays.
async function look() {
  const waiting = document.querySelector("[data-look]");
  if (!waiting) return;
  const answer = await fetch(`${location.pathname}?look=${waiting.dataset.look}`);
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const found = page.querySelector(".beside");
  if (found) waiting.replaceWith(found);
  later();
}

function later() {
  setTimeout(() => look().catch(later), 2000);
}
later();
