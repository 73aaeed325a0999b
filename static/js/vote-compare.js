// Both pictures in one place: B where A stands, or what only one of them has. Loaded when it is
// asked for first; neither says more of who drew what than the two pictures do.
import { text } from "./vote-page.js";

// Two pictures differ where a colour does by more than this of 255.
const LEAST = 40;
// Only A has it: orange bars that lie. Only B: blue ones that stand.
const ONLY = [[190, 80, 0], [0, 70, 200]];
const STRIPE_PX = 8;
const PALE = 0.3;
// Where they differ is looked for in pictures of this width.
const COARSE_PX = 600;
let asked = 0;

export async function show(lens, what, isOn = lens.stands !== what) {
  const { pair } = lens;
  const number = ++asked;
  const makes = { blink: blinked, difference: differing };
  const pictures = isOn ? await makes[what](pair).catch(() => null) : pair.images;
  // Released, decided or asked for something else meanwhile.
  if (!pictures || number !== asked || pair !== lens.pair || (!isOn && !lens.stands)) return;
  lens.put(pictures, isOn ? what : "");
}

// The second picture in both places.
async function blinked({ images: [, b], alts }) {
  const copy = Object.assign(b.cloneNode(), { alt: alts.b });
  await copy.decode();
  return [copy, b];
}

// What each has of its own against the scene before any change, the rest pale; without that
// scene both are marked wherever they differ.
async function differing(pair) {
  if (pair.difference) return pair.difference;
  const { images, originals, shown } = pair;
  await originals?.[0].decode();
  const [a, b, before] = [...images, originals?.[0] ?? images[1]].map((image) => pixels(image, shown));
  const made = new ImageData(shown.width, shown.height);
  for (let at = 0; at < a.length; at += 4) {
    const [x, y] = [(at / 4) % shown.width, Math.floor(at / 4 / shown.width)];
    const differs = apart(a, b, at);
    const has = [a, b].map((one) => differs && (!originals || apart(one, before, at)));
    const side = has[0] && has[1] ? (x + y) % (2 * STRIPE_PX) < STRIPE_PX : has[1];
    const own = has[0] || has[1];
    const isBar = (side ? x : y) % STRIPE_PX < STRIPE_PX - 3;
    for (let channel = 0; channel < 3; channel += 1) {
      const pale = 255 - (255 - before[at + channel]) * PALE;
      made.data[at + channel] = own && isBar ? ONLY[Number(side)][channel] : pale;
    }
    made.data[at + 3] = 255;
  }
  pair.difference = [0, 1].map(() => {
    const canvas = surface(shown);
    canvas.getContext("2d").putImageData(made, 0, 0);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", text("difference"));
    return canvas;
  });
  return pair.difference;
}

const apart = (one, other, at) => Math.abs(one[at] - other[at]) + Math.abs(one[at + 1] - other[at + 1]) + Math.abs(one[at + 2] - other[at + 2]) > LEAST;

// The part of the pictures, from 0 to 1, in which either differs from the scene before; null for none.
export async function changeOf(pair) {
  if (pair.change !== undefined) return pair.change;
  const { images, originals, shown } = pair;
  await originals?.[0].decode();
  const size = { width: COARSE_PX, height: Math.round((COARSE_PX * shown.height) / shown.width) };
  const [a, b, before] = [...images, originals?.[0] ?? images[1]].map((image) => pixels(image, size));
  const found = { left: 1, right: 0, top: 1, bottom: 0 };
  // An inset shows the change at another place.
  const isCovered = (x, y) => shown.covered_px?.some(([left, top, right, low]) => x > left - 6 && x < right + 6 && y > top - 6 && y < low + 6);
  for (let at = 0; at < a.length; at += 4) {
    if (!apart(a, before, at) && !apart(b, before, at)) continue;
    const [x, y] = [((at / 4) % size.width) / size.width, Math.floor(at / 4 / size.width) / size.height];
    if (isCovered(x * shown.width, y * shown.height)) continue;
    Object.assign(found, { left: Math.min(found.left, x), right: Math.max(found.right, x) });
    Object.assign(found, { top: Math.min(found.top, y), bottom: Math.max(found.bottom, y) });
  }
  pair.change = found.right ? found : null;
  return pair.change;
}

function surface({ width, height }) {
  return Object.assign(document.createElement("canvas"), { width, height });
}

function pixels(image, shown) {
  const context = surface(shown).getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0, shown.width, shown.height);
  return context.getImageData(0, 0, shown.width, shown.height).data;
}
