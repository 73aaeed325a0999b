// Rows of a job's grid follow as one scrolls, a page of them after the other. A grid that is shown
// anew every second keeps its link to the next page, as one without a script does.
let isLoading = false;

async function extend() {
  const next = document.querySelector("#live:not([data-live]) #more [rel=next]");
  if (isLoading || !next || next.getBoundingClientRect().top > 2 * innerHeight) return;
  isLoading = true;
  try {
    const answer = await fetch(next.href);
    if (!answer.ok) return;
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    document.querySelector(".grid").append(page.querySelector(".grid tbody"));
    document.getElementById("more").replaceWith(page.getElementById("more"));
  } catch {
    return; // scrolling on asks again
  } finally {
    isLoading = false;
  }
  extend();
}

// Whoever comes back from a cell finds it where it was.
addEventListener("click", ({ target }) => {
  const cell = target.closest(".grid a.cell");
  if (cell) history.replaceState(null, "", `${cell.closest("tbody").dataset.at}#${cell.id}`);
});
addEventListener("scroll", extend, { capture: true, passive: true });
extend();
