// The key ? opens the glossary and closes it, unless somebody types; Escape closes it.
const glossary = document.getElementById("glossary");

document.addEventListener("keydown", ({ key, target }) => {
  if (key === "Escape") glossary.open = false;
  if (key === "?" && !target.closest("input, textarea, select")) glossary.open = !glossary.open;
});
