// The first page: a table of all episodes of which only the lines in sight are made, a heat map, and pairs.
import { keepState, make, onKeys, root, stateOf } from "./help.js";
import { filterOf, follow, grouped, meanOf, orderOf, rangeOf, sortedNames } from "./rows.js";

const LINE_PX = 34;
const MARGIN = 8;
const COLUMNS = [
  ["environment", "Environment", ""], ["solution", "Solution", ""], ["seed", "Seed", "number minor"],
  ["robot", "Robot", "minor"], ["state", "Outcome", "minor"], ["score", "Score", "number"], ["steps", "Steps", "number minor"],
  ["set", "From", "minor"],
];
const get = (id) => document.getElementById(id);
const [scroller, table, body] = [get("scroller"), get("table"), get("table").tBodies[0]];
let [rows, shown, range] = [[], [], [0, 1]];
let state = stateOf();
let place = -1;
let drawn = "";
let [unscored, told] = [0, 0];

function apply() {
  const fits = filterOf(state.q ?? "", { solution: state.solution, environment: state.environment, state: state.state });
  shown = rows.filter(fits);
  if (state.sort) shown.sort(orderOf(state.sort));
  place = state.at ? shown.findIndex((row) => row.id === state.at) : -1;
  const mean = meanOf(shown);
  const of = shown.length === rows.length ? "" : ` of ${rows.length.toLocaleString("en")}`;
  const waiting = unscored ? ` · ${unscored.toLocaleString("en")} to be scored` : "";
  get("count").textContent = `${shown.length.toLocaleString("en")}${of} episodes${mean === null ? "" : ` · mean ${mean.toFixed(3)}`}${waiting}`;
  range = rangeOf(rows);
  drawn = "";
  draw();
}

function draw() {
  const view = state.view ?? "table";
  sessionStorage.setItem("benchbot-table", location.href);
  for (const name of ["table", "heat", "pairs"]) get(`${name}-view`).hidden = view !== name;
  for (const link of document.querySelectorAll(".tabs a")) {
    if (link.dataset.view === view) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
  }
  if (view === "table") drawTable(); else if (view === "heat") drawHeat(); else drawPairs();
}

function drawTable() {
  get("nothing").hidden = shown.length > 0;
  scroller.hidden = shown.length === 0;
  const first = Math.max(0, Math.floor(scroller.scrollTop / LINE_PX) - MARGIN);
  const last = Math.min(shown.length, first + Math.ceil((scroller.clientHeight || 600) / LINE_PX) + 2 * MARGIN);
  const now = `${first} ${last} ${place}`;
  if (now === drawn) return;
  drawn = now;
  table.setAttribute("aria-rowcount", shown.length + 1);
  const lines = [spacer(first)];
  for (let i = first; i < last; i += 1) lines.push(line(shown[i], i));
  lines.push(spacer(shown.length - last));
  const focused = document.activeElement?.closest?.("tbody a") ? document.activeElement.dataset.id : null;
  body.replaceChildren(...lines);
  if (focused) body.querySelector(`a[data-id="${focused}"]`)?.focus({ preventScroll: true });
}

function spacer(count) {
  const cell = make("td");
  const row = make("tr", { class: "spacer", "aria-hidden": "true" }, cell);
  cell.style.height = row.style.height = `${count * LINE_PX}px`;
  return row;
}

export function addressOf(row) {
  if (row.state === "running" && row.set === "under way") return `${root}live/${row.id}.html`;
  return `${root}episode/${row.id}.html`;
}

function line(row, i) {
  const isOpen = row.state !== "pending" && !(row.state === "running" && row.set !== "under way") && row.state !== "ended";
  const name = isOpen ? make("a", { href: addressOf(row), "data-id": row.id }, row.environment) : row.environment;
  const condition = row.episode === null ? row.seed ?? "" : `${row.seed ?? ""} / ${row.episode}`;
  const bar = make("i");
  bar.style.setProperty("--share", `${(100 * (row.score - range[0])) / (range[1] - range[0] || 1)}%`);
  const score = make("div", { class: "score-cell" });
  if (row.score !== null) score.append(bar, make("span", { title: row.scoreName }, row.score.toFixed(3))); else score.append("–");
  const badge = make("span", { class: row.failed ? "badge bad" : "badge", title: row.why, "data-state": row.state }, row.state);
  const cells = [
    make("td", { title: row.solution }, row.solution), make("td", { class: "number minor" }, String(condition)),
    make("td", { class: "minor" }, row.robot), make("td", { class: "minor" }, badge), make("td", { class: "number" }, score),
    make("td", { class: "number minor" }, row.steps === null ? "" : String(row.steps)), make("td", { class: "minor", title: row.set }, row.set),
  ];
  const made = make("tr", { class: i === place ? "at" : "", "aria-rowindex": i + 2 }, make("th", { scope: "row" }, name), ...cells);
  return made;
}

function drawHeat() {
  const bySolution = grouped(shown, (row) => row.solution);
  const environments = sortedNames(shown.map((row) => row.environment));
  const [low, high] = range;
  const cell = (found, query, name) => {
    const mean = meanOf(found);
    const link = make("a", { href: `#${new URLSearchParams(query)}`, "aria-label": `${name}: ${mean === null ? "no score" : mean.toFixed(3)}, ${found.length} episodes` }, mean === null ? "–" : mean.toFixed(2));
    link.style.setProperty("--share", mean === null ? 0 : ((mean - low) / (high - low || 1)).toFixed(3));
    return link;
  };
  const head = make("tr", {}, make("td"), ...environments.map((name) => make("th", { scope: "col" }, name)), make("th", { scope: "col" }, "all"));
  const lines = sortedNames(bySolution.keys()).map((solution) => {
    const byEnvironment = grouped(bySolution.get(solution), (row) => row.environment);
    const cells = environments.map((environment) => {
      const found = byEnvironment.get(environment);
      return make("td", {}, ...(found ? [cell(found, { solution, environment, sort: "score" }, `${solution} in ${environment}`)] : []));
    });
    return make("tr", {}, make("th", { scope: "row" }, solution), ...cells, make("td", { class: "mean" }, cell(bySolution.get(solution), { solution, sort: "score" }, `${solution} in all`)));
  });
  get("heat").replaceChildren(make("thead", {}, head), make("tbody", {}, ...lines));
  get("heat-note").textContent = `Shades go from ${low.toFixed(2)} to ${high.toFixed(2)}; episodes without a score are left out${new Set(shown.map((row) => row.scoreName).filter(Boolean)).size > 1 ? "; there are scores of several methods: choose those of one task, since their means say nothing together" : ""}. A field leads to its episodes, the worst first.`;
}

function drawPairs() {
  const names = sortedNames(rows.map((row) => row.solution));
  const [a, b] = [names.includes(state.a) ? state.a : names[0], names.includes(state.b) ? state.b : names.find((name) => name !== (state.a ?? names[0])) ?? names[0]];
  for (const [id, value] of [["a", a], ["b", b]]) options(get(id), names, value ?? "", null);
  const key = (row) => JSON.stringify([row.task, row.environment, row.robot, row.seed, row.repeat, row.episode]);
  const theirs = grouped(shown.filter((row) => row.solution === b && row.score !== null), key);
  const pairs = [];
  for (const row of shown) {
    if (row.solution !== a || row.score === null) continue;
    const other = theirs.get(key(row))?.[0];
    if (other && other.id !== row.id) pairs.push([row, other, row.score - other.score]);
  }
  pairs.sort((x, y) => x[2] - y[2]);
  const most = Math.max(...pairs.map((pair) => Math.abs(pair[2])), 1e-9);
  const lines = pairs.slice(0, 500).map(([mine, other, difference]) => {
    const bar = make("span", { class: difference < 0 ? "difference less" : "difference" }, make("i"));
    const width = (50 * Math.abs(difference)) / most;
    bar.style.setProperty("--left", `${difference < 0 ? 50 - width : 50}%`);
    bar.style.setProperty("--width", `${width}%`);
    const both = new URLSearchParams({ a: mine.id, b: other.id });
    const seed = [["seed", mine.seed], ["repeat", mine.repeat], ["episode", mine.episode]].filter(([, value]) => value !== null).map((pair) => pair.join(" ")).join(", ");
    return make("tr", {}, make("th", { scope: "row" }, make("a", { href: `${root}side-by-side.html#${both}` }, mine.environment)),
      make("td", {}, seed), make("td", { class: "number" }, mine.score.toFixed(3)), make("td", { class: "number" }, other.score.toFixed(3)),
      make("td", { class: "number" }, `${difference < 0 ? "−" : "+"}${Math.abs(difference).toFixed(3)}`), make("td", {}, bar));
  });
  const head = ["environment", "episode", "new", "old", "new − old", ""].map((text, i) => text ? make("th", { scope: "col", class: i > 1 ? "number" : "" }, text) : make("td"));
  get("pairs").replaceChildren(make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...lines));
  const won = pairs.filter((pair) => pair[2] > 0).length;
  const lost = pairs.filter((pair) => pair[2] < 0).length;
  const mean = pairs.reduce((sum, pair) => sum + pair[2], 0) / (pairs.length || 1);
  get("pairs-note").textContent = pairs.length
    ? `${pairs.length} pair${pairs.length === 1 ? "" : "s"} of the same episode: ${won} better, ${lost} worse, mean difference ${mean < 0 ? "−" : "+"}${Math.abs(mean).toFixed(3)}. The worst come first${pairs.length > 500 ? "; 500 are shown" : ""}. Whether that is more than chance says benchbot compare.`
    : "No episode has been done, and scored, by both of them.";
}

function options(select, names, value, all) {
  const wanted = JSON.stringify([names, all]);
  if (select.dataset.names !== wanted) {
    select.dataset.names = wanted;
    select.replaceChildren(...(all === null ? [] : [new Option(all, "")]), ...names.map((name) => new Option(name, name)));
  }
  select.value = names.includes(value) ? value : "";
}

function change(changes, { restart = true } = {}) {
  state = Object.fromEntries(Object.entries({ ...state, ...changes }).filter(([, value]) => value !== ""));
  keepState(state);
  if (restart) scroller.scrollTop = 0;
  apply();
}

function reflect() {
  get("filter").value = state.q ?? "";
  for (const name of ["solution", "environment", "state"]) {
    options(get(name), sortedNames(rows.map((row) => row[name])), state[name] ?? "", { solution: "All solutions", environment: "All environments", state: "All outcomes" }[name]);
  }
  for (const button of table.tHead.querySelectorAll("button")) {
    const sort = state.sort ?? "";
    const isOwn = sort.replace(/^-/, "") === button.dataset.sort;
    const cell = button.parentElement;
    if (isOwn) cell.setAttribute("aria-sort", sort.startsWith("-") ? "descending" : "ascending"); else cell.removeAttribute("aria-sort");
    button.textContent = button.dataset.label + (isOwn ? (sort.startsWith("-") ? " ↓" : " ↑") : "");
  }
}

function drawBatches(batches) {
  const list = get("batches");
  list.hidden = batches.length === 0;
  list.replaceChildren(...batches.map((batch) => {
    const left = batch.left_s === null ? "" : ` · ${batch.left_s > 5400 ? `${(batch.left_s / 3600).toFixed(1)} h` : `${Math.ceil(batch.left_s / 60)} min`} left`;
    const score = batch.score === null ? "" : ` · ${batch.score.name} ${batch.score.value.toFixed(3)}`;
    const text = `${batch.finished.toLocaleString("en")} of ${batch.episodes.toLocaleString("en")}, ${batch.running} running${batch.failures ? `, ${batch.failures} failed` : ""}${score}${left}`;
    return make("li", {}, make("b", {}, batch.name), make("progress", { max: batch.episodes, value: batch.finished, "aria-label": batch.name }), make("span", {}, text));
  }));
}

function step(by) {
  if (!shown.length || (state.view ?? "table") !== "table") return false;
  place = Math.min(Math.max(place + by, 0), shown.length - 1);
  const [top, height] = [place * LINE_PX, scroller.clientHeight - 2 * LINE_PX];
  if (top < scroller.scrollTop) scroller.scrollTop = top;
  else if (top > scroller.scrollTop + height - LINE_PX) scroller.scrollTop = top - height + LINE_PX;
  change({ at: shown[place].id }, { restart: false });
  return true;
}

table.tHead.rows[0].append(...COLUMNS.map(([name, label, kind]) => {
  const button = make("button", { "data-sort": name, "data-label": label }, label);
  button.addEventListener("click", () => {
    change({ sort: state.sort === name ? `-${name}` : state.sort === `-${name}` ? "" : name });
    reflect();
  });
  return make("th", { scope: "col", class: kind }, button);
}));
const WIDTHS = ["17%", "18%", "6%", "13%", "11%", "17%", "7%", "11%"];
[...table.tHead.rows[0].cells].forEach((cell, i) => { cell.style.width = WIDTHS[i]; });
scroller.addEventListener("scroll", () => requestAnimationFrame(drawTable), { passive: true });
addEventListener("resize", draw);
get("filter").addEventListener("input", (event) => change({ q: event.target.value, at: "" }));
for (const name of ["solution", "environment", "state"]) get(name).addEventListener("change", (event) => change({ [name]: event.target.value, at: "" }));
for (const name of ["a", "b"]) get(name).addEventListener("change", (event) => change({ a: get("a").value, b: get("b").value, [name]: event.target.value }));
get("clear").addEventListener("click", () => { change({ q: "", solution: "", environment: "", state: "", at: "" }); reflect(); });
for (const link of document.querySelectorAll(".tabs a")) {
  link.addEventListener("click", (event) => { event.preventDefault(); change({ view: link.dataset.view === "table" ? "" : link.dataset.view }); });
}
body.addEventListener("click", (event) => {
  const link = event.target.closest("tr")?.querySelector("a");
  if (link && event.target !== link) link.click();
});
addEventListener("hashchange", () => { state = stateOf(); reflect(); apply(); });
onKeys({
  "/": () => get("filter").focus(),
  ArrowDown: () => step(1), ArrowUp: () => step(-1), j: () => step(1), k: () => step(-1),
  Enter: (event) => {
    if (event.target.matches("a, button, summary") || place < 0) return false;
    body.querySelector("tr.at a")?.click();
    return true;
  },
  e: () => change({ view: "" }), h: () => change({ view: "heat" }), c: () => change({ view: "pairs" }),
  Escape: () => { change({ q: "", solution: "", environment: "", state: "", at: "" }); reflect(); document.activeElement.blur(); },
});
follow((found, answer, isNew) => {
  rows = found;
  unscored = answer.unscored;
  drawBatches(answer.batches);
  if (answer.lost) { get("count").textContent = "The server does not answer."; return; }
  if (isNew || unscored !== told) { told = unscored; reflect(); apply(); }
}).catch(() => { get("count").textContent = "The server does not answer."; });
