// Whole groups by one tick, and how many augmentations that makes. Without it the form works too.
const form = document.querySelector("[data-choose]");

function members(group) {
  return [...group.querySelectorAll("input[type=checkbox]:not([data-all]):not(:disabled)")];
}

function refresh() {
  for (const group of form.querySelectorAll("[data-group]")) {
    const all = group.querySelector("[data-all]");
    if (!all) continue;
    const ticked = members(group).filter((box) => box.checked).length;
    const count = group.querySelector("[data-ticked]");
    if (count) count.textContent = ticked ? `: ${ticked} chosen` : "";
    all.checked = ticked > 0 && ticked === members(group).length;
    all.indeterminate = ticked > 0 && !all.checked;
  }
  const sum = form.querySelector("[data-sum]");
  if (!sum) return;
  const contestants = form.querySelectorAll(
    "[name=contestants]:checked, [name=cells]:checked",
  ).length;
  const scenarios = form.querySelectorAll("[name=scenarios]:checked").length;
  sum.hidden = false;
  sum.querySelector("[data-contestants]").textContent = contestants;
  sum.querySelector("[data-scenarios]").textContent = scenarios;
  // Studies have the same page without samples.
  const entered = form.querySelector("[name=samples]");
  const samples = entered ? Math.max(1, parseInt(entered.value, 10) || 1) : 1;
  if (entered) sum.querySelector("[data-samples]").textContent = samples;
  sum.querySelector("[data-total]").textContent = contestants * scenarios * samples;
}

// The estimate of a new job comes with the page that its button would bring.
const estimate = form.querySelector("[data-estimate]");
let requests = 0;

async function askEstimate() {
  const mine = ++requests;
  const sent = new FormData(form);
  sent.set("estimate", "1");
  const answer = await fetch(form.action, { method: "POST", body: sent });
  if (!answer.ok || mine !== requests) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.querySelector("[data-estimate]");
  if (fresh && mine === requests) estimate.replaceChildren(...fresh.childNodes);
}

if (estimate) {
  let timer = 0;
  form.querySelector("[data-ask]").hidden = true;
  const askSoon = () => {
    clearTimeout(timer);
    timer = setTimeout(() => askEstimate().catch(() => estimate.replaceChildren()), 300);
  };
  form.addEventListener("change", askSoon);
  // Filled in from another job: what of it is there already is what one wants to know.
  if (form.querySelector("[name=scenarios]:checked")) askSoon();
}

form.addEventListener("change", (event) => {
  if (event.target.matches("[data-all]")) {
    for (const box of members(event.target.closest("[data-group]"))) {
      box.checked = event.target.checked;
    }
  }
  refresh();
});
refresh();
