// Choosing a moment: the slider and the dots of the map are one choice; what a worker draws is
// looked for until it is there. Without this file the forms work, and the page loads itself again.
const LOOK_MS = 700;
const LOOKS = 400;
let looking = 0;

function tell(form) {
  const slider = form.elements.stop;
  const at = Number(slider.value);
  const told = form.querySelector("[data-told]");
  const frame = told.dataset.frame.replace("{n}", slider.dataset.frames.split(",")[at]);
  const time = slider.dataset.times.split(",")[at];
  told.textContent = time ? `${told.dataset.time.replace("{n}", Number(time).toFixed(1))}, ${frame}` : frame;
  for (const dot of form.querySelectorAll("[data-stop]")) {
    dot.classList.toggle("is-chosen", dot.dataset.stop === String(at));
  }
}

// The dot nearest to a click: dots of a standing ego lie on each other, and fingers are wide.
function nearest(map, { clientX, clientY }) {
  const at = new DOMPoint(clientX, clientY).matrixTransform(map.getScreenCTM().inverse());
  const away = (dot) => Math.hypot(dot.cx.baseVal.value - at.x, dot.cy.baseVal.value - at.y);
  return [...map.querySelectorAll("[data-stop]")].reduce((a, b) => (away(b) < away(a) ? b : a));
}

function take(page, answer) {
  const found = page.getElementById("moment");
  const here = document.getElementById("moment");
  if (!found || !here) {
    location.assign(answer.url);
    return;
  }
  if (found.outerHTML !== here.outerHTML) here.replaceWith(document.adoptNode(found));
  const messages = page.querySelector(".messages")?.parentElement;
  document.querySelector(".messages")?.parentElement.remove();
  if (messages) document.getElementById("main").prepend(document.adoptNode(messages));
  const kept = page.getElementById("kept");
  if (kept) {
    document.getElementById("kept")?.remove();
    document.getElementById("main").append(document.adoptNode(kept));
  }
}

async function load(address, options) {
  const answer = await fetch(address, options);
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  return [page, answer];
}

// Look for the moment until no worker is busy with it any more; a newer wish ends an older look.
async function follow(mine, page, answer) {
  for (let n = 0; n < LOOKS; n += 1) {
    if (mine !== looking) return;
    take(page, answer);
    const section = document.getElementById("moment");
    if (!section || section.dataset.waits === undefined) return;
    await new Promise((done) => setTimeout(done, LOOK_MS));
    if (mine !== looking) return;
    try {
      [page, answer] = await load(`?moment=${section.dataset.code}`);
    } catch {
      // The network may be back at the next turn.
    }
  }
}

async function show(form) {
  const mine = ++looking;
  form.setAttribute("aria-busy", "true");
  try {
    const [page, answer] = await load(form.action, { method: "POST", body: new FormData(form) });
    await follow(mine, page, answer);
  } catch (fault) {
    if (mine === looking) throw fault;
  } finally {
    form.removeAttribute("aria-busy");
  }
}

for (const form of document.querySelectorAll(".timeline")) {
  let timer = 0;
  const soon = () => {
    clearTimeout(timer);
    timer = setTimeout(() => show(form).catch(() => form.submit()), 250);
  };
  form.elements.stop.addEventListener("input", () => tell(form));
  form.elements.stop.addEventListener("change", soon);
  form.querySelector("svg")?.addEventListener("click", (event) => {
    const dot = nearest(event.currentTarget, event);
    form.elements.stop.value = dot.dataset.stop;
    tell(form);
    soon();
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    show(form).catch(() => form.submit());
  });
  tell(form);
}

document.addEventListener("submit", (event) => {
  const form = event.target.closest("#moment form");
  if (!form) return;
  event.preventDefault();
  show(form).catch(() => form.submit());
});

// The file itself is still being read: look again for the whole page.
if (document.querySelector("[data-state][data-waits]")) setTimeout(() => location.reload(), 1500);
else if (document.querySelector("#moment[data-waits]")) {
  follow(++looking, document, { url: location.href });
}
