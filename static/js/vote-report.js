// The place that a report is about: a press in a picture while the panel of reports is open.
// Loaded when that opens first.
import { at, note } from "./vote-page.js";

const SIDES = ["A", "B"];
// A press this near to the mark takes it away again.
const NEAR_PX = 12;
const side = at("vote").elements.report_side;
const box = at("report").lastElementChild;
let lens = null;

// Shows the mark of the pair on the screen, as long as the panel is open.
export function aim(ofPage) {
  if (!lens) {
    lens = ofPage;
    lens.panels.forEach(listen);
    at("report").addEventListener("change", draw);
    // The panel covers the pictures, so it gives way.
    at("mark").addEventListener("click", () => give(true));
    at("mark").disabled = false; // so that no press before is lost
  }
  if (box.hidden) give(false);
  draw();
}

function give(isAiming) {
  box.hidden = isAiming;
  note(isAiming ? at("mark").dataset.aim : "");
}

function listen(panel, place) {
  // Else it would close the panel, pan or measure.
  panel.addEventListener("pointerdown", (event) => at("report").open && event.stopPropagation(), true);
  panel.addEventListener("click", ({ clientX, clientY }) => {
    if (!at("report").open) return;
    const { left, top, width, height } = lens.scenes[place].getBoundingClientRect();
    const share = (value) => Math.min(1, Math.max(0, value));
    const [x, y] = [share((clientX - left) / width), share((clientY - top) / height)];
    const [x0, y0] = lens.pair.mark ?? [NaN, NaN];
    const isAgain = Math.hypot((x - x0) * width, (y - y0) * height) < NEAR_PX;
    lens.pair.mark = isAgain ? null : [x, y];
    if (!isAgain) side.value = SIDES[place];
    if (box.hidden) give(false);
    draw();
  });
}

function draw() {
  const { mark, shown: { width, height } } = lens.pair;
  const r = width / 40;
  lens.scenes.forEach(({ lastElementChild: svg }, place) => {
    const spot = svg.querySelector(".spot") ?? svg.appendChild(document.createElementNS(svg.namespaceURI, "path"));
    spot.setAttribute("class", "spot");
    spot.setAttribute("stroke-width", width / 200);
    const isMarked = mark && at("report").open && ["both", SIDES[place]].includes(side.value);
    spot.setAttribute("d", isMarked ? `M${mark[0] * width - r} ${mark[1] * height}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0` : "");
  });
}
