// A scale bar over each zoomed picture whose own one is out of sight; loaded with the first zoom.
import { text } from "./vote-page.js";

const UNITS_M = [0.5, 1, 2, 5, 10];
const LEAST_PX = 48;
const LOOK = "position:absolute;right:.5rem;bottom:.5rem;border:solid #212529;border-width:0 2px 3px;background:#ffffffd9;color:#212529;font-size:.75rem;text-align:center;pointer-events:none";
let bars = null;

export function draw(lens) {
  bars ??= lens.panels.map((panel) => {
    const bar = document.createElement("span");
    bar.className = "scale-bar";
    bar.style.cssText = LOOK;
    return panel.appendChild(bar);
  });
  lens.hasScale = true;
  const { px_per_m, width } = lens.pair.shown;
  for (const [place, panel] of lens.panels.entries()) {
    const metre = (panel.clientWidth / width) * px_per_m * lens.scale;
    const unit = UNITS_M.find((metres) => metres * metre >= LEAST_PX) ?? 20;
    bars[place].hidden = !lens.isZoomed || showsOwn(panel, lens.scenes[place], lens.pair.shown);
    bars[place].textContent = text("metres", unit);
    bars[place].style.width = `${unit * metre}px`;
  }
}

// Whether the picture's own scale, the first thing that it has over the ground, is all in the panel.
function showsOwn(panel, scene, { covered_px: [own] = [], width, height }) {
  if (!own) return false;
  const [frame, picture] = [panel.getBoundingClientRect(), scene.getBoundingClientRect()];
  const [left, right] = [own[0], own[2]].map((x) => picture.left + (x / width) * picture.width);
  const [top, low] = [own[1], own[3]].map((y) => picture.top + (y / height) * picture.height);
  return left >= frame.left && right <= frame.right && top >= frame.top && low <= frame.bottom;
}
