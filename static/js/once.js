// A form is sent once. The server counts it once anyway; a second press would lose the first answer's message.
const AGAIN_MS = 10_000;
let pressed = new WeakSet();

addEventListener("submit", (event) => {
  const form = event.target;
  if (event.defaultPrevented || form.getAttribute("method") !== "post") return;
  if (pressed.has(form)) return event.preventDefault();
  pressed.add(form);
  setTimeout(() => pressed.delete(form), AGAIN_MS);
});
// Who goes back to the page may send it again.
addEventListener("pageshow", () => { pressed = new WeakSet(); });
