// The help panel, loaded when it is opened first, and the preferences that the account keeps.
import { ask } from "./vote-outbox.js";
import { at, drawKeys, given, text } from "./vote-page.js";

const help = at("help");
const form = at("preferences");
const { preferences, urls } = given;

const styled = new Promise((done) => {
  const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href: help.dataset.style });
  link.onload = link.onerror = done;
  document.head.append(link);
});

export async function showHelp() {
  for (const field of form.elements) field.checked = preferences[field.name];
  await styled;
  if (!help.open) help.showModal();
}

form.addEventListener("change", async ({ target: { name, checked } }) => {
  const { status, body } = await ask(urls.preferences, { [name]: checked });
  if (status === 200) Object.assign(preferences, body);
  drawKeys();
  at("preferences-told").textContent = text(status === 200 ? "keys-kept" : "keys-lost");
});
