// The help panel, loaded when it is opened first: which keys do what, kept on the account.
import { ask } from "./vote-outbox.js";
import { at, drawKeys, given, text } from "./vote-page.js";

const help = at("help");
const form = at("keys");
const { preferences, urls } = given;
const told = at("keys-told");

const styled = new Promise((done) => {
  const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href: help.dataset.style });
  link.onload = link.onerror = done;
  document.head.append(link);
});

export async function showHelp() {
  for (const field of form.elements) {
    if (field.type === "checkbox") field.checked = preferences[field.name];
    else if (field.name) field.value = preferences.keys[field.name][0] ?? "";
  }
  told.textContent = "";
  await styled;
  if (!help.open) help.showModal();
}

async function keep(changes) {
  const { status, body } = await ask(urls.preferences, changes);
  if (status === 200) {
    Object.assign(preferences, body);
    drawKeys();
    showHelp();
  }
  const faults = Object.values(body?.error?.fields ?? {}).flat().join(" ");
  told.textContent = status === 200 ? text("keys-kept") : faults || text("keys-lost");
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  const keys = {};
  const changes = { keys };
  for (const field of form.elements) {
    if (field.type === "checkbox") changes[field.name] = field.checked;
    else if (field.value) keys[field.name] = field.value;
  }
  keep(changes);
});

form.addEventListener("reset", (event) => {
  event.preventDefault();
  keep({ keys: {}, single_keys: true });
});
