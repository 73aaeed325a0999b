// Objects of an intent are added, removed and turned into JSON without leaving the page. The server
// does it: what its answer has in this section takes the place of what stands here. Without this
// script the same buttons bring the whole page.
async function ask(form, button) {
  const sent = new FormData(form);
  sent.set(button.name, button.value);
  const answer = await fetch(form.action || location.href, { method: "POST", body: sent });
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const found = page.querySelector("[data-asks]");
  if (!found) throw new Error("The answer has no such section.");
  document.querySelector("[data-asks]").replaceWith(found);
  const asks = found.querySelectorAll("[data-ask]");
  const next = button.value === "write" ? found.querySelector("#intent") : asks[asks.length - 1];
  (next.matches("textarea") ? next : next.querySelector("select")).focus();
}

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

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-asks] button[name=fields]");
  if (!button) return;
  event.preventDefault();
  if (button.dataset.busy) return;
  button.dataset.busy = "1";
  ask(button.form, button).catch(() => {
    // What the script can't do, the form does.
    const field = Object.assign(document.createElement("input"), { type: "hidden" });
    field.name = button.name;
    field.value = button.value;
    button.form.noValidate = true;
    button.form.append(field);
    button.form.submit();
  });
});
