// The rows of the table: reading them, page by page and as they change; filtering and sorting them.
import { block, isStatic, root } from "./help.js";

export const NAMES = ["id", "set", "solution", "task", "environment", "robot", "seed", "repeat", "episode", "state", "why",
  "scoreName", "score", "steps", "changed", "revision"];
const PERIOD_MS = 2000;
const NUMBERS = ["seed", "repeat", "episode", "score", "steps"];
const WELL = ["done", "pending", "running", "ended"];

function rowOf(values) {
  const row = {};
  NAMES.forEach((name, place) => { row[name] = values[place]; });
  row.text = [row.set, row.solution, row.environment, row.robot, row.state, row.task, row.why].join(" ").toLowerCase();
  row.failed = !WELL.includes(row.state);
  return row;
}

/** Read all rows, and again and again what has changed; `told` is called with rows and the rest of each answer. */
export async function follow(told) {
  const rows = [];
  const places = new Map();
  const take = (answer) => {
    for (const values of answer.rows) {
      const row = rowOf(values);
      const place = places.get(row.id);
      if (place === undefined) { places.set(row.id, rows.length); rows.push(row); } else rows[place] = row;
    }
  };
  if (isStatic) {
    const answer = block("rows");
    take(answer);
    told(rows, answer, true);
    return;
  }
  const ask = async (query) => (await fetch(`${root}data/rows?${query}`)).json();
  let answer = await ask("start=0");
  let revision = answer.revision;
  take(answer);
  told(rows, answer, true);
  for (let start = answer.rows.length; start && start < answer.total; start += answer.rows.length) {
    answer = await ask(`start=${start}`);
    if (!answer.rows.length) break;
    revision = Math.min(revision, answer.revision);
    take(answer);
    told(rows, answer, true);
  }
  const again = async () => {
    if (!document.hidden) {
      try {
        answer = await ask(`since=${revision}`);
        revision = answer.revision;
        take(answer);
        told(rows, answer, answer.rows.length > 0);
      } catch { told(rows, { lost: true, batches: [], unscored: 0 }, false); }
    }
    setTimeout(again, PERIOD_MS);
  };
  setTimeout(again, PERIOD_MS);
}

/** Return whether a row fits a filter: `words`, `seed:2`, `score<0.3`, `failed`, and the exact values of choices. */
export function filterOf(text, choices) {
  const tests = [];
  for (const [name, value] of Object.entries(choices)) if (value) tests.push((row) => row[name] === value);
  for (const word of text.toLowerCase().split(/\s+/).filter(Boolean)) {
    const found = /^([a-z]+)(<=|>=|<|>|=|:)(.+)$/.exec(word);
    const number = found ? Number(found[3]) : NaN;
    if (word === "failed") tests.push((row) => row.failed);
    else if (found && NUMBERS.includes(found[1]) && !Number.isNaN(number)) {
      const holds = { "<": (a) => a < number, ">": (a) => a > number, "<=": (a) => a <= number, ">=": (a) => a >= number }[found[2]] ?? ((a) => a === number);
      tests.push((row) => row[found[1]] !== null && holds(row[found[1]]));
    } else if (found && NAMES.includes(found[1])) tests.push((row) => String(row[found[1]] ?? "").toLowerCase().includes(found[3]));
    else tests.push((row) => row.text.includes(word));
  }
  return (row) => tests.every((test) => test(row));
}

const collator = new Intl.Collator("en", { numeric: true });

/** Return the order of a column; what has no value comes last either way. */
export function orderOf(sort) {
  const falling = sort.startsWith("-");
  const name = sort.replace(/^-/, "");
  const sign = falling ? -1 : 1;
  return (a, b) => {
    const [x, y] = [a[name], b[name]];
    const [noX, noY] = [x === null || x === "", y === null || y === ""];
    if (noX || noY) return noX - noY;
    return sign * (typeof x === "string" ? collator.compare(x, y) : x - y);
  };
}

/** Return the mean of the scores of rows, null without any. */
export function meanOf(rows) {
  let [sum, count] = [0, 0];
  for (const row of rows) if (row.score !== null) { sum += row.score; count += 1; }
  return count ? sum / count : null;
}

/** Return the range of some scores, as bars and shades take it: zero to one, or what there is. */
export function rangeOf(rows) {
  let [low, high] = [0, 1];
  for (const row of rows) if (row.score !== null) { low = Math.min(low, row.score); high = Math.max(high, row.score); }
  return [low, high];
}

/** Return rows by what a function says of them. */
export function grouped(rows, key) {
  const found = new Map();
  for (const row of rows) { const name = key(row); if (found.has(name)) found.get(name).push(row); else found.set(name, [row]); }
  return found;
}

export function sortedNames(names) { return [...new Set(names)].sort(collator.compare); }
