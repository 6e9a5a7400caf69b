// Words and numbers: robots, changes, a path; and the table to download.

import { heading } from "./colours.js";
import { element } from "./dom.js";
import { digitsOf } from "./robot.js";

const TOP = 100; // of the fittest, compared

/** A number with its sign, or a dash where the design diverged. */
function number(value, decimals = 2, signed = false) {
  if (value === null || value === undefined) return "diverged";
  const text = Math.abs(value).toFixed(decimals);
  const isZero = Number(text) === 0;
  if (value < 0 && !isZero) return `−${text}`;
  return signed && !isZero ? `+${text}` : text;
}

/** The rank of a design, from 1: one more than there are better ones. */
function rankOf(fitness, design) {
  return 1 + fitness.filter((value) => value !== null && value > fitness[design]).length;
}

/** One line about a design, for the cell under the pointer. */
export function inShort(design, atlas, values) {
  const fitness = values.fitness[design];
  const words = [`${design} · ${digitsOf(design)}`, `fitness ${number(fitness)}`];
  if (fitness) words.push(`heading ${number(heading(values.dx[design], values.dy[design]), 0)}°`);
  words.push(`under noise ${number(atlas.noise[design])}`);
  words.push(`published ${number(atlas.fitness[design])}`);
  return words.join(", ");
}

/** Fill the table of facts with one robot, or two and their difference. */
export function fillFacts(table, robots, atlas, values) {
  const rows = [
    ["design", (r) => r.design],
    ["digits", (r) => r.digits],
    ["voxels, active", (r) => `${atlas.n_voxels[r.design]}, ${atlas.n_active[r.design]}`],
    ["in one piece", (r) => (atlas.is_connected[r.design] ? "yes" : "no")],
    ["fitness", (r) => r.fitness, 4],
    ["published", (r) => atlas.fitness[r.design], 4],
    ["mean under noise", (r) => atlas.noise[r.design], 2],
    ["rank of 6561", (r) => (r.fitness === null ? "none" : rankOf(values.fitness, r.design))],
    ["dx", (r) => r.dx, 2],
    ["dy", (r) => r.dy, 2],
    ["heading, °", (r) => (r.fitness ? heading(r.dx, r.dy) : "none"), 1],
  ];
  const two = robots.length > 1;
  const names = [...robots.map((_, k) => "AB"[k]), ...(two ? ["B − A"] : [])];
  const head = names.map((text) => element("th", { text, scope: "col" }));
  const body = rows.map(([name, of, decimals]) => {
    const given = robots.map(of);
    const show = (value) => (typeof value === "string" || !decimals ? value : number(value, decimals));
    const texts = given.map(show);
    if (two) {
      const isNumber = decimals && given.every((value) => typeof value === "number");
      const change = name.startsWith("heading") ? turn(given[1] - given[0]) : given[1] - given[0];
      texts.push(isNumber ? number(change, decimals, true) : "");
    }
    const cells = texts.map((text) => element("td", { text }));
    return element("tr", {}, element("th", { text: name, scope: "row" }), ...cells);
  });
  table.replaceChildren(element("tr", {}, element("td"), ...head), ...body);
}

function turn(degrees) {
  return ((((degrees + 180) % 360) + 360) % 360) - 180;
}

/** All designs, the fittest first; of equals the lower number, and what diverged last. */
function ranking(fitness) {
  return fitness.map((_, i) => i).sort((a, b) => (fitness[b] ?? -1) - (fitness[a] ?? -1));
}

/** What changed between two landscapes: {stayed, best, former, lines}, in words. */
export function changesOf(before, now) {
  const [then, order] = [ranking(before), ranking(now)];
  const [best, former] = [order[0], then[0]];
  const top = new Set(then.slice(0, TOP));
  const differences = now.flatMap((value, i) => (value === null ? [] : [value - before[i]]));
  const mean = differences.reduce((sum, value) => sum + value, 0) / differences.length;
  const diverged = now.length - differences.length;
  const lines = [`${order.slice(0, TOP).filter((design) => top.has(design)).length} of the top ${TOP} stayed`];
  if (best === former) {
    lines.push(`★ ${best} is still the best: ${number(now[best])}`);
  } else {
    lines.push(`★ ${best} is the best now: ${number(now[best])}, was rank ${then.indexOf(best) + 1}`);
    const rank = order.indexOf(former) + 1;
    const fate = now[former] === null ? "it diverged" : `now rank ${rank}, ${number(now[former])}`;
    lines.push(`☆ ${former} was the best: ${fate}`);
  }
  lines.push(`mean change ${differences.length ? number(mean, 3, true) : "unknown"} voxel widths`);
  if (diverged) lines.push(`${diverged} designs diverged (×)`);
  return { best, former, lines };
}

/** The designs of a path that were the best so far: [{design, at}]. */
export function improvements({ designs, fitness }) {
  const found = [];
  let best = -1;
  designs.forEach((design, at) => {
    if ((fitness[at] ?? -1) > best) {
      best = fitness[at];
      found.push({ design, at });
    }
  });
  return found;
}

/** Tell how far a path came. */
export function pathInShort(path, upto, atlas) {
  const best = path.best.filter(({ at }) => at < upto).at(-1);
  const different = new Set(path.designs.slice(0, upto)).size;
  const words = `${upto} of ${path.designs.length} evaluations, ${different} designs`;
  if (!best) return words;
  const at = best.at + 1;
  const found = `◆ best ${best.design} (${number(atlas.fitness[best.design])}), at evaluation ${at}`;
  const isEnd = upto === path.designs.length;
  const when = path.total > upto ? ` after all ${path.total}` : "";
  const end = isEnd ? `; it recommends ${path.recommended}${when}, rank ${path.rank} of all` : "";
  return `${words}; ${found}${end}`;
}
