// The keys that answer pairs answer those of the practice as well.
import { actionOf } from "./vote-keys.js";

const preferences = JSON.parse(document.getElementById("preferences").textContent);
addEventListener("keydown", (event) => {
  const side = !event.repeat && actionOf(event, preferences)?.replace("_clearly", "");
  const hint = side && document.querySelector(`.answers [data-key="${side}"]`);
  if (!hint) return;
  event.preventDefault();
  hint.closest("button").click();
});
