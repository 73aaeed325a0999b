// The moment that is chosen in the strip is shown large; the browser's own keys go from one to the
// next. Facts of the one that the page was loaded with would be wrong then.
addEventListener("change", ({ target }) => {
  const { picture } = target.dataset;
  const shown = document.getElementById("chosen");
  if (!picture || !shown) return;
  shown.src = picture;
  document.getElementById("facts")?.remove();
});
