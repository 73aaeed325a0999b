// Keys 1, 2 and 3 tick the faults, Enter saves; in the note they are what is typed.
const form = document.getElementById("label");
const boxes = [...form.querySelectorAll("input[type=checkbox]")];
const note = form.querySelector("[data-none]");
let isSent = false;

function tell() {
  note.textContent = boxes.some((box) => box.checked) ? note.dataset.some : note.dataset.none;
}

for (const box of boxes) box.addEventListener("change", tell);
tell();

form.addEventListener("submit", (event) => {
  if (isSent) event.preventDefault();
  isSent = true;
});

addEventListener("keydown", (event) => {
  const isModified = event.ctrlKey || event.altKey || event.metaKey || event.shiftKey;
  if (event.repeat || event.isComposing || isModified || event.target.name === "note") return;
  const box = boxes["123".indexOf(event.key)];
  if (box) {
    event.preventDefault();
    box.checked = !box.checked;
    tell();
  } else if (event.key === "Enter" && !event.target.closest("a, button, summary")) {
    event.preventDefault();
    form.requestSubmit();
  }
});

// A page that comes back from the browser's memory may show a picture that is labelled already.
addEventListener("pageshow", (event) => {
  if (event.persisted) location.reload();
});
