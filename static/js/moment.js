// The moment that is chosen in the strip is shown large; the browser's own keys go from one to the
// next. On a map a click puts the ego on the nearest lane.
const REACH_PX = 25;

addEventListener("change", async ({ target }) => {
  const { picture, moment } = target.dataset;
  const shown = document.getElementById("chosen");
  if (!picture || !shown) return;
  shown.src = picture;
  // Facts and places of the moment that was shown before are wrong now, whatever comes instead.
  show(document.implementation.createHTMLDocument());
  const answer = await fetch(`?moment=${moment}`);
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  if (target.checked) show(page);
});

function show(page) {
  for (const id of ["facts", "places"]) {
    document.getElementById(id)?.replaceChildren(...(page.getElementById(id)?.childNodes ?? []));
  }
  const place = document.getElementById("place");
  if (place) place.value = page.getElementById("place")?.value ?? "";
}

/** Returns the place on a lane that is nearest to a point of the picture, "" if none is near. */
function nearestPlace(x, y) {
  const lanes = JSON.parse(document.getElementById("places").textContent || "{}");
  let place = "";
  let least = REACH_PX;
  for (const [lane, rows] of Object.entries(lanes)) {
    for (const [s, rowX, rowY] of rows) {
      const apart = Math.hypot(rowX - x, rowY - y);
      if (apart < least) [least, place] = [apart, `${lane},${s}`];
    }
  }
  return place;
}

addEventListener("click", ({ target, offsetX, offsetY }) => {
  if (target.id !== "chosen" || !document.getElementById("places")) return;
  const scale = target.naturalWidth / target.clientWidth;
  const place = nearestPlace(offsetX * scale, offsetY * scale);
  const field = document.getElementById("place");
  if (!place) return;
  field.value = place;
  field.form.requestSubmit(field.form.elements.put);
});
