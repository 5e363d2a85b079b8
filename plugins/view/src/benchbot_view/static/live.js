// A run that is under way: what its feed tells, as often as there is news.
import { block, make, onKeys, root } from "./help.js";
import { paint } from "./pictures.js";

const PERIOD_MS = 250;
const get = (id) => document.getElementById(id);
const episode = block("episode");
const figures = [...document.querySelectorAll("figure[data-kind]")];
const map = document.querySelector("svg.map");
const pixel = ([x, y]) => `${((x - episode.scene.low[0]) * 100).toFixed(1)},${((episode.scene.high[1] - y) * 100).toFixed(1)}`;
let number = 0;
let lines = "";
let turns = 0;
const painted = {};

function draw(view) {
  get("frames").textContent = view.frames;
  get("time").textContent = view.time_s === null ? "–" : `${view.time_s.toFixed(1)} s`;
  get("rate").textContent = view.frames_per_s || "–";
  get("state").textContent = view.alive ? (view.paused ? "paused" : "under way") : "ended";
  get("activity").textContent = view.alive ? view.last || view.activity || view.problem : view.problem;
  if (view.result && !view.alive) { get("result").href = `${root}episode/${view.result}.html`; get("result").hidden = false; }
  map.querySelector(".driven").setAttribute("points", view.path.map(pixel).join(" "));
  const place = view.pose.translation_xyz ?? (view.path.length ? view.path.at(-1) : null);
  const robot = map.querySelector(".robot");
  robot.toggleAttribute("hidden", !place);
  if (place) {
    const turned = view.pose.rotation_xyzw ? (2 * Math.atan2(view.pose.rotation_xyzw[2], view.pose.rotation_xyzw[3]) * 180) / Math.PI : 0;
    robot.setAttribute("transform", `translate(${pixel(place).replace(",", " ")}) rotate(${(-turned).toFixed(1)})`);
  }
  const text = JSON.stringify(view.log);
  if (text !== lines) {
    lines = text;
    get("log").replaceChildren(...view.log.map((line) => make("li", { class: `past ${line.level}` }, `${line.source} | ${line.text}`)));
    get("log").scrollTop = get("log").scrollHeight;
  }
  if (view.number === number) return;
  number = view.number;
  for (const figure of figures) {
    figure.hidden = !view.channels.includes(figure.dataset.kind);
    if (figure.hidden) continue;
    const image = new Image();
    const turn = (turns += 1);
    // One that is overtaken by a newer one comes too late.
    image.onload = () => {
      if (turn < (painted[figure.dataset.kind] ?? 0)) return;
      painted[figure.dataset.kind] = turn;
      paint(figure.querySelector("canvas"), image);
    };
    image.src = `${root}picture/live/${episode.id}/${figure.dataset.kind}?${number}`;
  }
}

async function follow() {
  if (!document.hidden) {
    try {
      const answer = await fetch(`${root}data/live/${episode.id}`);
      if (answer.ok) {
        const view = await answer.json();
        draw(view);
        if (!view.alive) return;
      } else get("state").textContent = "ended";
    } catch { get("state").textContent = "The server does not answer."; }
  }
  setTimeout(follow, PERIOD_MS);
}

onKeys({ Escape: () => location.assign(`${root}index.html`) });
follow();
