// Pictures of observations on canvases: fetched ahead, kept as long as there is room, with boxes drawn over them.
import { root } from "./help.js";

const KEPT = 160;
const AHEAD = 12;
const NEAREST_M = 0.05;
const ENDINGS = { frame: ".jpg", depth: "-depth.png", classes: "-classes.png" };
const STRETCHES = 16;
const EDGES = [];
for (let i = 0; i < 8; i += 1) for (const bit of [1, 2, 4]) if (!(i & bit)) EDGES.push([i, i | bit]);

/** The pictures of one kind of one episode; `loaded` is called when the one that was last asked for has come. */
export class Pictures {
  constructor(id, kind, numbers, loaded) {
    this.id = id;
    this.kind = kind;
    this.numbers = numbers;
    this.loaded = loaded;
    this.kept = new Map();
    this.wanted = null;
  }

  /** Return the newest observation up to `number` that has a picture, null without one. */
  nearest(number) {
    const place = this.placeOf(number);
    return place < 0 ? null : this.numbers[place];
  }

  /** Return the address of the picture of an observation. */
  address(number) { return `${root}picture/${this.id}/${this.kind}/${String(number).padStart(5, "0")}${ENDINGS[this.kind]}`; }

  /** Return the picture of an observation, or null: then `loaded` is called once it has come. */
  get(number) {
    this.wanted = number;
    const image = this.fetch(number);
    this.kept.delete(number);
    this.kept.set(number, image);
    return image.complete && image.naturalWidth ? image : null;
  }

  /** Fetch what comes next. */
  fetchAround(number) {
    const place = this.placeOf(number);
    for (let i = 1; i <= AHEAD; i += 1) for (const other of [this.numbers[place + i], this.numbers[place - i]]) if (other !== undefined) this.fetch(other);
  }

  placeOf(number) {
    let [low, high] = [0, this.numbers.length];
    while (low < high) { const middle = (low + high) >> 1; if (this.numbers[middle] <= number) low = middle + 1; else high = middle; }
    return low - 1;
  }

  fetch(number) {
    let image = this.kept.get(number);
    if (image) return image;
    image = new Image();
    image.decoding = "async";
    // Whether it is wanted is asked when it comes: one that was fetched ahead may have become the one to be shown.
    image.onload = () => { if (number === this.wanted) this.loaded(); };
    // One that did not come is fetched anew when it is asked for again.
    image.onerror = () => { if (this.kept.get(number) === image) this.kept.delete(number); };
    image.src = this.address(number);
    this.kept.set(number, image);
    for (const old of this.kept.keys()) { if (this.kept.size <= KEPT) break; this.kept.delete(old); }
    return image;
  }
}

/** Draw a picture over a whole canvas. */
export function paint(canvas, image) {
  if (canvas.width !== image.naturalWidth || canvas.height !== image.naturalHeight) {
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
  }
  canvas.getContext("2d", { willReadFrequently: true }).drawImage(image, 0, 0);
}

/** Return which stretches of a box's edges are hidden, of what evidence says of them. */
export function stretchesOf(text) { return text ? Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)) : null; }

/**
 * Draw the edges of a box (centre and size in the map frame) as a camera sees it; `camera` is its rotation and place.
 * `hidden` has a bit for each stretch of an edge, true for all, null for none: these are dashed. The label is above the
 * box, or below it.
 */
export function paintBox(canvas, camera, intrinsics, box, color, label, hidden = null, isBelow = false) {
  const scale = canvas.width / intrinsics.width;
  const corners = [];
  for (let i = 0; i < 8; i += 1) {
    const point = [0, 1, 2].map((axis) => box[axis] + (i & (1 << axis) ? 0.5 : -0.5) * box[axis + 3] - camera[9 + axis]);
    corners.push([0, 1, 2].map((axis) => camera[axis] * point[0] + camera[3 + axis] * point[1] + camera[6 + axis] * point[2]));
  }
  const context = canvas.getContext("2d");
  const pixel = ([x, y, z]) => [(intrinsics.fx * x / z + intrinsics.cx) * scale, (intrinsics.fy * y / z + intrinsics.cy) * scale];
  const lines = [];
  const behind = [];
  EDGES.forEach(([i, j], edge) => {
    const isHidden = (part) => hidden === true || Boolean(hidden && hidden[(edge * STRETCHES + part) >> 3] & (128 >> ((edge * STRETCHES + part) & 7)));
    for (let first = 0, next; first < STRETCHES; first = next) {
      for (next = first + 1; next < STRETCHES && isHidden(next) === isHidden(first);) next += 1;
      let [a, b] = [first, next].map((part) => corners[i].map((value, axis) => value + (part / STRETCHES) * (corners[j][axis] - value)));
      if (a[2] < NEAREST_M && b[2] < NEAREST_M) continue;
      if (a[2] < NEAREST_M) a = clipped(b, a);
      if (b[2] < NEAREST_M) b = clipped(a, b);
      (isHidden(first) ? behind : lines).push([pixel(a), pixel(b)]);
    }
  });
  if (!lines.length && !behind.length) return;
  const size = Math.max(canvas.width / 480, 1);
  context.lineCap = "round";
  for (const [some, dashes] of [[behind, [2 * size, 7 * size]], [lines, []]]) {
    context.setLineDash(dashes);
    for (const [width, shade] of [[4 * size, "rgb(0 0 0 / 55%)"], [2 * size, color]]) {
      context.lineWidth = dashes.length ? width * 0.7 : width;
      context.strokeStyle = shade;
      context.beginPath();
      for (const [[x0, y0], [x1, y1]] of some) { context.moveTo(x0, y0); context.lineTo(x1, y1); }
      context.stroke();
    }
  }
  context.setLineDash([]);
  if (!label) return;
  const points = [...lines, ...behind].flat().filter(([x, y]) => x > -canvas.width && x < 2 * canvas.width && y > -canvas.height && y < 2 * canvas.height);
  if (!points.length) return;
  context.font = `600 ${Math.round(12 * size)}px system-ui, sans-serif`;
  const width = context.measureText(label).width;
  const x = Math.min(Math.max(Math.min(...points.map((point) => point[0])), 2), canvas.width - width - 10 * size);
  const heights = points.map((point) => point[1]);
  const y = Math.min(Math.max(isBelow ? Math.max(...heights) + 15 * size : Math.min(...heights) - 6 * size, 16 * size), canvas.height - 6);
  context.fillStyle = "rgb(0 0 0 / 65%)";
  context.fillRect(x - 4 * size, y - 12 * size, width + 8 * size, 16 * size);
  context.fillStyle = color;
  context.fillText(label, x, y);
}

function clipped(inside, outside) {
  const share = (inside[2] - NEAREST_M) / (inside[2] - outside[2]);
  return inside.map((value, axis) => value + share * (outside[axis] - value));
}
