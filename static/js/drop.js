// Files that are dropped on the form, or chosen in it, are sent at once; where they stand for
// somebody's work they are shown first, with the button that sends them.
const form = document.querySelector("[data-drop]");
const field = form.elements.file;
const chosen = form.querySelector("[data-chosen]");

function mark(on) {
  form.classList.toggle("is-over", on);
}

form.addEventListener("dragover", (event) => {
  event.preventDefault();
  mark(true);
});
form.addEventListener("dragleave", () => mark(false));
form.addEventListener("drop", (event) => {
  event.preventDefault();
  mark(false);
  if (!event.dataTransfer.files.length) return;
  field.files = event.dataTransfer.files;
  take();
});
function take() {
  const [file] = field.files;
  if (chosen) {
    chosen.hidden = !file;
    if (file) chosen.querySelector("output").textContent = `${file.name}, ${size(file.size)}`;
  } else if (file) form.requestSubmit();
}
function size(bytes) {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
field.addEventListener("change", take);
take(); // what was chosen before this script was there
