// Two episodes beside each other, in step: each is the page of an episode, and they are told where to go.
import { keepState, make, onKeys, root, stateOf } from "./help.js";

const FRAMES_PER_S = 8;
const get = (id) => document.getElementById(id);
const sides = [get("left"), get("right")];
const slider = get("slider");
const counts = [0, 0];
let state = stateOf();
let at = Number(state.t) || 0;
let timer = null;

function seek(number, from = null) {
  at = Math.min(Math.max(number, 0), Number(slider.max));
  slider.value = at;
  get("now").replaceChildren(make("b", {}, `observation ${at + 1}`), ` of ${counts.map((count) => count || "–").join(" and ")}`);
  slider.setAttribute("aria-valuetext", `observation ${at + 1}`);
  sides.forEach((side) => { if (side.contentWindow !== from) side.contentWindow?.postMessage({ benchbot: "seek", at }, "*"); });
  state = { ...state, t: at || "" };
  keepState(state);
  return true;
}

function play() {
  if (timer) { clearInterval(timer); timer = null; } else {
    if (at >= Number(slider.max)) seek(0);
    timer = setInterval(() => { if (at >= Number(slider.max)) play(); else seek(at + 1); }, 1000 / FRAMES_PER_S);
  }
  get("play").setAttribute("aria-pressed", Boolean(timer));
  get("play").firstElementChild.textContent = timer ? "❚❚" : "▶";
  return true;
}

addEventListener("message", (event) => {
  const place = sides.findIndex((side) => side.contentWindow === event.source);
  if (place < 0 || event.data?.benchbot !== "at") return;
  const isFirst = counts[place] === 0;
  counts[place] = Number(event.data.count) || 0;
  slider.max = Math.max(...counts) - 1;
  if (isFirst) seek(at); else seek(Number(event.data.at) || 0, event.source);
});
slider.addEventListener("input", () => seek(Number(slider.value)));
get("play").addEventListener("click", play);
onKeys({
  ArrowLeft: (event) => seek(at - (event.shiftKey ? 10 : 1)),
  ArrowRight: (event) => seek(at + (event.shiftKey ? 10 : 1)),
  Home: () => seek(0), End: () => seek(Number(slider.max)),
  " ": (event) => (event.target.matches("button") ? false : play()),
  Escape: () => location.assign(`${root}index.html#view=pairs`),
});
const isId = /^[0-9a-f]{12}$/;
if (isId.test(state.a) && isId.test(state.b)) {
  [state.a, state.b].forEach((id, place) => { sides[place].src = `${root}episode/${id}.html#embed=1`; });
} else {
  get("nothing").hidden = false;
  for (const side of sides) side.hidden = true;
}
