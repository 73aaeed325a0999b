// Files that are dropped on the form, or chosen in it, are sent at once.
const form = document.querySelector("[data-drop]");
const field = form.elements.file;

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
  form.requestSubmit();
});
function sendChosen() {
  if (field.files.length) form.requestSubmit();
}
field.addEventListener("change", sendChosen);
sendChosen(); // what was chosen before this script was there
