// Keys 1, 2 and 3 press the buttons; a pair counts only when both pictures are there.
const BOUNCE_MS = 200; // the second half of a double click must not judge the next pair
const form = document.getElementById("vote");
const buttons = [...form.querySelectorAll("button")];
const pictures = [...document.querySelectorAll(".panel img")];
let shownAt = null;
let isSent = false;

function show(now) {
  shownAt = now;
  setTimeout(() => { form.inert = false; }, BOUNCE_MS);
}

function refuse() {
  document.getElementById("no-picture").hidden = false;
  for (const button of buttons) button.disabled = true;
}

form.inert = true;
Promise.all(pictures.map((picture) => picture.decode())).then(
  () => requestAnimationFrame(show),
  refuse,
);

form.addEventListener("submit", (event) => {
  if (isSent || shownAt === null) {
    event.preventDefault();
    return;
  }
  isSent = true;
  form.elements.ms_visible.value = Math.round(performance.now() - shownAt);
});

addEventListener("keydown", (event) => {
  const isModified = event.ctrlKey || event.altKey || event.metaKey || event.shiftKey;
  if (event.repeat || event.isComposing || isModified || form.inert) return;
  const button = buttons["123".indexOf(event.key)];
  if (button && !button.disabled) {
    event.preventDefault();
    form.requestSubmit(button);
  }
});

// A page that comes back from the browser's memory may show a pair that is decided already.
addEventListener("pageshow", (event) => {
  if (event.persisted) location.reload();
});
