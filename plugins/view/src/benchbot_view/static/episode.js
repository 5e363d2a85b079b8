// The page of an episode: everything moves with one slider, and an object is lit wherever it is shown.
import { block, isStatic, keepState, make, onKeys, root, stateOf } from "./help.js";
import { paint, paintBox, Pictures, stretchesOf } from "./pictures.js";
import { showSpace } from "./space.js";

const TRUTH = "#ffec9c";
const ESTIMATE = "#78d7ff";
const FRAMES_PER_S = 8;
const REEL = 12;
const POOR = 0.5;
const get = (id) => document.getElementById(id);
const episode = block("episode");
const slider = get("slider");
const count = episode.frames.length;
let state = stateOf();
let at = Math.min(Math.max(Number(state.t) || 0, 0), Math.max(count - 1, 0));
let chosen = state.o === undefined ? null : Number(state.o);
let lit = null;
let allBoxes = state.boxes === "all";
let evidence = { frames: [], seen: [] };
let isLooked = false;
let space = null;
let spaceOf = -1;
let timer = null;
let stretches = new Map();
let firstSeen = [];
const pictures = {};
const objectRows = [...document.querySelectorAll("tr[data-object]")];
const figures = Object.fromEntries([...document.querySelectorAll("figure[data-kind]")].map((figure) => [figure.dataset.kind, figure]));
const maps = [...document.querySelectorAll("svg.map")];
const logLines = [...(get("log")?.children ?? [])];
const logFrames = logLines.map((line) => Number(line.dataset.frame));
const ways = episode.scenes.map((scene) => scene.path.map(([x, y]) => `${((x - scene.low[0]) * 100).toFixed(1)},${((scene.high[1] - y) * 100).toFixed(1)}`));
const wayEnds = endsOfWays();
const sceneNow = () => episode.frames[at]?.scene ?? 0;
let shownScene = sceneNow();

// The number of points of the way until each observation: the way is a line through more places than observations.
function endsOfWays() {
  const next = episode.scenes.map(() => 0);
  return episode.frames.map((frame) => {
    const path = episode.scenes[frame.scene]?.path ?? [];
    if (!frame.base) return path.length;
    let best = next[frame.scene];
    let nearest = Infinity;
    for (let i = best; i < path.length; i += 1) {
      const distance = Math.hypot(path[i][0] - frame.base[0], path[i][1] - frame.base[1]);
      if (distance < nearest - 1e-9) { nearest = distance; best = i; }
      if (nearest < 0.01 && distance > 0.5) break;
    }
    next[frame.scene] = best;
    return best + 1;
  });
}

function draw() {
  const frame = episode.frames[at] ?? { scene: 0 };
  slider.value = at;
  drawPictures();
  for (const map of maps) {
    const place = Number(map.dataset.scene);
    map.toggleAttribute("hidden", place !== shownScene);
    map.querySelector(".driven").setAttribute("points", place === frame.scene ? ways[place].slice(0, wayEnds[at]).join(" ") : place < frame.scene ? ways[place].join(" ") : "");
    const robot = map.querySelector(".robot");
    robot.toggleAttribute("hidden", place !== frame.scene || !frame.base);
    if (frame.base && place === frame.scene) {
      const scene = episode.scenes[place];
      robot.setAttribute("transform", `translate(${((frame.base[0] - scene.low[0]) * 100).toFixed(1)} ${((scene.high[1] - frame.base[1]) * 100).toFixed(1)}) rotate(${((-frame.base[2] * 180) / Math.PI).toFixed(1)})`);
    }
  }
  if (space && spaceOf === shownScene) space.at(at);
  tell(frame);
  drawLog();
}

function drawPictures() {
  for (const [kind, found] of Object.entries(pictures)) {
    const number = found.nearest(at);
    const image = number === null ? null : found.get(number);
    figures[kind].classList.toggle("waiting", !image);
    if (!image) continue;
    const canvas = figures[kind].querySelector("canvas");
    paint(canvas, image);
    found.fetchAround(number);
    const { camera, scene } = episode.frames[number] ?? {};
    if (camera && episode.camera) for (const box of boxesOf(scene, number)) paintBox(canvas, camera, episode.camera, ...box);
  }
}

function boxesOf(scene, number) {
  const wanted = lit ?? chosen;
  const boxes = [];
  for (const item of episode.objects) {
    if (item.scene !== scene || !(item.number === wanted || allBoxes)) continue;
    const isWanted = item.number === wanted;
    // One name for both, where both have the same.
    const isNamed = isWanted && !(item.estimated && item.label === item.truth_label);
    if (item.true) boxes.push([item.true, TRUTH, isNamed ? item.truth_label : "", hiddenOf(item.number, number, 2), Boolean(item.estimated)]);
    if (item.estimated) boxes.push([item.estimated, ESTIMATE, isWanted ? estimateOf(item) : "", hiddenOf(item.number, number, 3)]);
  }
  return boxes;
}

function estimateOf(item) { return item.probability === null ? item.label : `${item.label} ${item.probability.toFixed(2)}`; }

// Which edges of an object's box are hidden in a frame: all of them in one that does not see it.
function hiddenOf(object, number, place) {
  if (!evidence.seen.length) return null;
  const key = `${object} ${number} ${place}`;
  if (!stretches.has(key)) {
    const view = evidence.seen[object]?.find(([other]) => other === number);
    stretches.set(key, view ? stretchesOf(view[place]) : true);
  }
  return stretches.get(key);
}

function tell(frame) {
  const time = frame.time_s === undefined || frame.time_s === null ? "" : ` · ${frame.time_s.toFixed(1)} s`;
  const done = frame.action ? ` · ${frame.action}${frame.outcome ? ` (${frame.outcome})` : ""}` : "";
  const seen = evidence.seen.length ? ` · ${firstSeen.filter((number) => number <= at).length} of ${episode.objects.length} objects seen` : "";
  get("now").replaceChildren(make("b", {}, count ? `${at + 1} of ${count}` : "no observations"), `${time}${done}${seen}`);
  slider.setAttribute("aria-valuetext", `${at + 1} of ${count}${time}${done}`);
}

function drawLog() {
  let now = -1;
  logLines.forEach((line, i) => {
    const isPast = logFrames[i] <= at;
    line.classList.toggle("past", isPast);
    line.classList.remove("now");
    if (isPast) now = i;
  });
  if (now < 0) return;
  logLines[now].classList.add("now");
  const box = get("log");
  box.scrollTop = logLines[now].offsetTop - box.offsetTop - box.clientHeight / 2;
}

let isAsked = false;
function soon() {
  if (isAsked) return;
  isAsked = true;
  requestAnimationFrame(() => { isAsked = false; draw(); });
}

let keeping = null;
function keep() {
  clearTimeout(keeping);
  keeping = setTimeout(() => {
    state = { ...state, t: at || "", o: chosen ?? "", boxes: allBoxes ? "all" : "", pane: get("space").hidden ? "" : "3d" };
    keepState(state);
    if (parent !== window) parent.postMessage({ benchbot: "state", state }, "*");
  }, 150);
}

function seek(number, isOwn = true) {
  const before = sceneNow();
  at = Math.min(Math.max(number, 0), Math.max(count - 1, 0));
  if (sceneNow() !== before) { shownScene = sceneNow(); showScene(); }
  soon();
  markReel();
  if (isOwn) { keep(); if (parent !== window) parent.postMessage({ benchbot: "at", at, count }, "*"); }
  return true;
}

function light(number) {
  lit = number;
  const wanted = lit ?? chosen;
  for (const row of objectRows) row.classList.toggle("lit", Number(row.dataset.object) === lit);
  for (const map of maps) {
    map.classList.toggle("dimmed", wanted !== null && map.querySelector(`[data-object="${wanted}"]`) !== null);
    for (const box of map.querySelectorAll("[data-object]")) box.classList.toggle("lit", Number(box.dataset.object) === wanted);
    const labels = map.querySelector(".labels");
    labels.replaceChildren();
    const box = wanted === null ? null : map.querySelector(`[data-object="${wanted}"]`);
    if (box) {
      const text = document.createElementNS("http://www.w3.org/2000/svg", "text");
      const item = episode.objects[wanted];
      text.textContent = item.truth_label || item.label;
      const bounds = box.getBBox();
      text.setAttribute("x", Math.min(Math.max(bounds.x + bounds.width / 2, 60), map.viewBox.baseVal.width - 60));
      text.setAttribute("y", bounds.y > 40 ? bounds.y - 10 : bounds.y + bounds.height + 26);
      text.setAttribute("text-anchor", "middle");
      labels.append(text);
    }
  }
  space?.light(wanted);
  soon();
}

function choose(number, { moves = true } = {}) {
  chosen = number;
  for (const row of objectRows) {
    const isChosen = Number(row.dataset.object) === chosen;
    row.classList.toggle("chosen", isChosen);
    row.querySelector("button").setAttribute("aria-pressed", isChosen);
  }
  const item = chosen === null ? null : episode.objects[chosen];
  const seen = chosen === null ? [] : evidence.seen[chosen] ?? [];
  if (item && item.scene !== shownScene) { shownScene = item.scene; showScene(); }
  if (moves && seen.length) seek(seen[0][0]);
  else if (moves && item && !evidence.measured && episode.camera) { const best = byGeometry(item); if (best !== null) seek(best); }
  drawTicks();
  drawReel(item, seen);
  light(null);
  keep();
  return true;
}

// Without evidence: the frame in whose middle the object is, and near.
function byGeometry(item) {
  const box = item.true ?? item.estimated;
  let [best, most] = [null, 0];
  episode.frames.forEach((frame, number) => {
    if (!frame.camera || frame.scene !== item.scene || !box) return;
    const offset = [0, 1, 2].map((axis) => box[axis] - frame.camera[9 + axis]);
    const [x, y, z] = [0, 1, 2].map((axis) => frame.camera[axis] * offset[0] + frame.camera[3 + axis] * offset[1] + frame.camera[6 + axis] * offset[2]);
    if (z < 0.3) return;
    const [u, v] = [(episode.camera.fx * x) / z / episode.camera.width, (episode.camera.fy * y) / z / episode.camera.height];
    if (Math.abs(u) > 0.45 || Math.abs(v) > 0.45) return;
    const value = (1 - Math.hypot(u, v)) / z;
    if (value > most) [best, most] = [number, value];
  });
  return best;
}

function drawReel(item, seen) {
  const reel = get("reel");
  const hasPictures = Boolean(pictures.frame);
  reel.hidden = !item;
  if (!item) return;
  const name = item.truth_label || item.label;
  const of = evidence.measured ? "saw" : "should have seen";
  get("reel-title").textContent = seen.length
    ? `${seen.length} frames ${of} this ${name}${item.outcome === "missed" ? ", which was missed" : ""}; the best first`
    : evidence.measured ? `No frame saw this ${name}: it was never in sight.`
      : evidence.seen.length ? `No frame has the whole of this ${name} in it.` : `Which frames saw this ${name} is being worked out …`;
  const best = seen.slice(0, REEL);
  const list = reel.querySelector("ol");
  list.replaceChildren(...(hasPictures ? best : []).map(([number]) => {
    const canvas = make("canvas", { width: 320, height: 180, "aria-hidden": "true" });
    const button = make("button", { "data-frame": number }, canvas, `frame ${number + 1}`);
    button.addEventListener("click", () => seek(number));
    const image = new Image();
    image.onload = () => {
      canvas.height = Math.round((320 * image.naturalHeight) / image.naturalWidth);
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      const frame = episode.frames[number];
      if (frame?.camera && item.true) paintBox(canvas, frame.camera, episode.camera, item.true, TRUTH, "", hiddenOf(item.number, number, 2));
      if (frame?.camera && item.estimated) paintBox(canvas, frame.camera, episode.camera, item.estimated, ESTIMATE, "", hiddenOf(item.number, number, 3));
    };
    image.src = pictures.frame.address(pictures.frame.nearest(number));
    return make("li", {}, button);
  }));
  markReel();
}

function markReel() {
  for (const button of document.querySelectorAll("#reel button")) {
    if (Number(button.dataset.frame) === at) button.setAttribute("aria-current", "true"); else button.removeAttribute("aria-current");
  }
}

function drawTicks() {
  const ticks = get("ticks");
  const last = Math.max(count - 1, 1);
  ticks.setAttribute("viewBox", `0 0 ${last * 10} 9`);
  const seen = new Set((chosen === null ? [] : evidence.seen[chosen] ?? []).map(([number]) => number));
  ticks.replaceChildren();
  episode.frames.forEach((frame, number) => {
    const isEvent = Boolean(frame.failure) || (frame.outcome && !["reached", "done", "None"].includes(frame.outcome));
    const kind = isEvent ? "event" : seen.has(number) ? "seen" : "";
    if (!kind && count > 400) return;
    const tick = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    const tall = kind !== "";
    tick.setAttribute("class", kind);
    tick.setAttribute("x", number * 10 - (tall ? 3 : 0.6));
    tick.setAttribute("width", tall ? 6 : 1.2);
    tick.setAttribute("y", tall ? 1 : 5);
    tick.setAttribute("height", tall ? 8 : 4);
    ticks.append(tick);
  });
}

function showScene() {
  const select = get("scene");
  if (select) select.value = shownScene;
  if (!get("space").hidden) openSpace();
  soon();
}

// One after the other: what is known of the place may change while it is still being drawn.
let opening = Promise.resolve();
function openSpace() {
  get("map").hidden = true;
  get("space").hidden = false;
  get("show-map").setAttribute("aria-pressed", "false");
  get("show-space").setAttribute("aria-pressed", "true");
  keep();
  opening = opening.then(drawSpace);
  return true;
}

async function drawSpace() {
  if (space && spaceOf === shownScene) { space.at(at); return; }
  const note = get("space-note");
  note.textContent = "Loading …";
  try {
    const cloud = block("cloud") ?? (evidence.cloud && !isStatic ? await (await fetch(`${root}data/cloud/${episode.id}`)).json() : null);
    const old = get("space-canvas");
    const canvas = space ? old.cloneNode() : old;
    if (space) old.replaceWith(canvas);
    const place = shownScene;
    space = await showSpace(canvas, episode, place, cloud);
    spaceOf = place;
    canvas.addEventListener("click", (event) => { const number = space.pick(event); if (number !== null) choose(number); });
    if (cloud) note.textContent = "Drag to turn, wheel to zoom, Shift to move.";
    else note.textContent = isLooked ? "No depth was recorded: there are boxes and the way alone. Record it with --record frames or mcap." : "What was seen is being worked out …";
    space.at(at);
    space.light(chosen);
  } catch {
    note.textContent = "This browser draws nothing in three dimensions (WebGL is missing).";
  }
}

function openMap() {
  get("map").hidden = false;
  get("space").hidden = true;
  get("show-map").setAttribute("aria-pressed", "true");
  get("show-space").setAttribute("aria-pressed", "false");
  keep();
  return true;
}

function play() {
  const button = get("play");
  if (timer) { clearInterval(timer); timer = null; } else {
    if (at >= count - 1) seek(0);
    timer = setInterval(() => { if (at >= count - 1) play(); else seek(at + 1); }, 1000 / FRAMES_PER_S);
  }
  button.setAttribute("aria-pressed", Boolean(timer));
  button.firstElementChild.textContent = timer ? "❚❚" : "▶";
  return true;
}

function nextFailure(by) {
  const failed = episode.objects.filter((item) => ["missed", "not there"].includes(item.outcome) || (item.quality !== null && item.quality < POOR)).map((item) => item.number);
  if (!failed.length) return false;
  const now = failed.indexOf(chosen);
  return choose(failed[now < 0 ? (by > 0 ? 0 : failed.length - 1) : (now + by + failed.length) % failed.length]);
}

function nextView() {
  const seen = (chosen === null ? [] : evidence.seen[chosen] ?? []).map(([number]) => number).sort((x, y) => x - y);
  return seen.length ? seek(seen.find((number) => number > at) ?? seen[0]) : false;
}

function take(found) {
  evidence = found;
  isLooked = true;
  stretches = new Map();
  firstSeen = found.seen.filter((views) => views.length).map((views) => Math.min(...views.map(([number]) => number)));
  drawBreakdown(found.breakdown ?? []);
  const numbers = { frame: found.frames.map((frame) => frame.number), depth: found.frames.filter((frame) => frame.depth_m).map((frame) => frame.number), classes: found.frames.filter((frame) => frame.classes).map((frame) => frame.number) };
  for (const [kind, known] of Object.entries(numbers)) {
    figures[kind].hidden = !known.length;
    if (pictures[kind] && known.length) pictures[kind].numbers = known;
    else if (known.length) pictures[kind] = new Pictures(episode.id, kind, known, soon);
  }
  get("cameras").classList.toggle("alone", !numbers.depth.length && !numbers.classes.length);
  get("no-pictures").hidden = numbers.frame.length > 0;
  if (!numbers.frame.length) figures.frame.hidden = true;
  const far = found.frames.find((frame) => frame.depth_m)?.depth_m;
  if (far) get("depth-scale").textContent = `bright is near, dark is ${far} m`;
  found.seen.forEach((frames, number) => {
    const cell = objectRows.find((row) => Number(row.dataset.object) === number)?.querySelector(".seen");
    if (cell) cell.textContent = frames.length ? `${frames.length} frame${frames.length === 1 ? "" : "s"}` : found.measured ? "never" : "–";
  });
  drawTicks();
  if (chosen !== null) choose(chosen, { moves: state.t === undefined });
  if (!get("space").hidden) { opening = opening.then(() => { spaceOf = -1; }); openSpace(); }
  soon();
}

function drawBreakdown(parts) {
  if (!parts.length || !get("breakdown")) return;
  get("breakdown").replaceChildren(...parts.map((part) => {
    const lines = part.groups.map((row) => {
      const bar = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      const inner = document.createElementNS("http://www.w3.org/2000/svg", "rect");
      for (const [name, value] of [["width", "100%"], ["height", 8], ["aria-hidden", "true"]]) bar.setAttribute(name, value);
      for (const [name, value] of [["class", "quality"], ["width", `${(100 * row.quality).toFixed(1)}%`], ["height", 8], ["rx", 2]]) inner.setAttribute(name, value);
      bar.append(inner);
      return make("tr", {}, make("th", { scope: "row" }, row.label), make("td", { class: "number" }, `${row.found} of ${row.objects}`), make("td", { class: "number" }, row.quality.toFixed(2)), make("td", { class: "bar-cell" }, bar));
    });
    const head = make("tr", {}, make("th", { scope: "col" }, "objects"), make("th", { scope: "col", class: "number" }, "found"), make("th", { scope: "col", class: "number" }, "quality"), make("td"));
    return make("table", { class: "costs" }, make("caption", { class: "note" }, part.by), make("thead", {}, head), make("tbody", {}, ...lines));
  }));
}

async function waitForEvidence() {
  const known = block("evidence");
  if (known || isStatic) { take(known ?? { frames: [], seen: [] }); return; }
  for (;;) {
    const answer = await fetch(`${root}data/evidence/${episode.id}`);
    if (answer.status === 200) { take(await answer.json()); return; }
    if (answer.status !== 202) return;
    await new Promise((resolve) => { setTimeout(resolve, 300); });
  }
}

slider.addEventListener("input", () => seek(Number(slider.value)));
get("play").addEventListener("click", play);
get("show-map").addEventListener("click", openMap);
get("show-space").addEventListener("click", openSpace);
get("scene")?.addEventListener("change", (event) => { shownScene = Number(event.target.value); showScene(); });
for (const row of objectRows) {
  const number = Number(row.dataset.object);
  row.addEventListener("mouseenter", () => light(number));
  row.addEventListener("mouseleave", () => light(null));
  row.addEventListener("focusin", () => light(number));
  row.addEventListener("focusout", () => light(null));
  row.addEventListener("click", () => choose(number));
}
for (const map of maps) {
  map.addEventListener("mouseover", (event) => { const box = event.target.closest("[data-object]"); if (box) light(Number(box.dataset.object)); });
  map.addEventListener("mouseout", (event) => { if (event.target.closest("[data-object]")) light(null); });
  map.addEventListener("click", (event) => {
    const box = event.target.closest("[data-object]");
    if (!box) return;
    choose(Number(box.dataset.object));
    objectRows.find((row) => row.dataset.object === box.dataset.object)?.scrollIntoView({ block: "nearest" });
  });
}
for (const button of document.querySelectorAll("#outcomes button")) {
  button.addEventListener("click", () => {
    for (const other of document.querySelectorAll("#outcomes button")) other.setAttribute("aria-pressed", other === button);
    for (const row of objectRows) row.hidden = button.dataset.outcome !== "" && row.dataset.outcome !== button.dataset.outcome;
  });
}
for (const line of logLines) line.addEventListener("click", () => seek(Number(line.dataset.frame)));
onKeys({
  ArrowLeft: (event) => seek(at - (event.shiftKey ? 10 : 1)),
  ArrowRight: (event) => seek(at + (event.shiftKey ? 10 : 1)),
  Home: () => seek(0), End: () => seek(count - 1),
  " ": (event) => (event.target.matches("button, a, summary") ? false : play()),
  n: () => nextFailure(1), p: () => nextFailure(-1), f: nextView,
  m: openMap, v: openSpace,
  b: () => { allBoxes = !allBoxes; soon(); keep(); },
  Escape: () => { if (chosen !== null) choose(null, { moves: false }); else if (parent === window) location.assign(get("back").href); },
});
addEventListener("hashchange", () => {
  const before = state;
  state = stateOf();
  if ((state.o ?? "") !== (before.o ?? "")) choose(state.o === undefined ? null : Number(state.o), { moves: false });
  seek(Number(state.t) || 0);
});
addEventListener("message", (event) => {
  if (event.source !== parent || event.data?.benchbot !== "seek") return;
  seek(Number(event.data.at) || 0, false);
});
if (state.embed) document.body.classList.add("embedded");
// Who came from the table goes back to it as it was filtered.
if (/(\/|index\.html)$/.test(sessionStorage.getItem("benchbot-table")?.split("#")[0] ?? "")) get("back").href = sessionStorage.getItem("benchbot-table");
// Pictures of the camera are there before it is worked out who saw what.
if (episode.pictured.length) pictures.frame = new Pictures(episode.id, "frame", episode.pictured, soon);
drawTicks();
draw();
if (state.pane === "3d") openSpace();
if (parent !== window) parent.postMessage({ benchbot: "at", at, count }, "*");
waitForEvidence();
