// Words and numbers: robots, changes, a path; and the table for download.

import { heading } from "./colours.js";
import { element } from "./page.js";
import { digitsOf } from "./robot.js";

export const TOP = 100; // the number of fittest designs to compare

/** A number with its sign, or a word if the design diverged. */
function number(value, decimals = 2, plus = "") {
  if (value === undefined) return "not known yet";
  if (value === null) return "diverged";
  const text = Math.abs(value).toFixed(decimals);
  const sign = value < 0 ? "−" : plus;
  return Number(text) === 0 ? text : sign + text;
}

/** The rank of a design: 1 plus the number of better ones. */
export function rankOf(fitness, design) {
  if (fitness[design] === null) return "none";
  return 1 + fitness.filter((value) => value !== null && value > fitness[design]).length;
}

/** One line about a design, for the cell under the pointer. */
export function inShort(design, atlas, { dx, dy, fitness }) {
  return [
    `${design} · ${digitsOf(design)}`,
    `fitness ${number(fitness[design])}`,
    ...headingInWords(dx[design], dy[design]),
    `published ${number(atlas.fitness[design])}`,
    `under noise ${number(atlas.noise[design])}`,
  ].join(", ");
}

/** A shorter line about the same design in another world. */
export function inBrief(design, { dx, dy, fitness }) {
  return [`fitness ${number(fitness[design])}`, ...headingInWords(dx[design], dy[design])].join(", ");
}

function headingInWords(dx, dy) {
  const towards = heading(dx, dy);
  return towards === null ? [] : [`heading ${number(towards, 0)}°`];
}

/**
 * Fill the table of facts with columns {name, design, moved: [dx, dy], world}; two columns get their
 * difference as well.
 */
export function fillFacts(table, columns, atlas) {
  const told = columns.map(({ design, moved: [x, y], world }) => {
    const isThere = x === x && y === y;
    const [dx, dy, fitness] = isThere ? [x, y, Math.sqrt(x * x + y * y)] : [null, null, null];
    const rank = world.isWhole ? rankOf(world.values.fitness, design) : "not known yet";
    return { design, dx, dy, fitness, rank };
  });
  const rows = [
    ["design", ({ design }) => design],
    ["digits", ({ design }) => digitsOf(design)],
    ["voxels, active", ({ design }) => atlas.counts[design].join(", ")],
    ["in one piece", ({ design }) => (atlas.is_connected[design] ? "yes" : "no")],
    ["fitness", ({ fitness }) => fitness, 4],
    ["published", ({ design }) => atlas.fitness[design], 4],
    ["step error, voxel widths", ({ design }) => atlas.step_error[design], 4],
    ["published, under noise", ({ design }) => atlas.noise[design], 2],
    ["rank of 6561", ({ rank }) => rank],
    ["dx", ({ dx }) => dx, 2],
    ["dy", ({ dy }) => dy, 2],
    ["heading, °", ({ dx, dy }) => heading(dx, dy) ?? "none", 1],
  ];
  const row = (name, texts, tag, scope) =>
    element("tr", {}, name, ...texts.map((text) => element(tag, { text, ...scope })));
  const isTwo = columns.length === 2;
  const body = rows.map(([name, of, decimals]) => {
    const given = told.map(of);
    const isCount = decimals === undefined;
    const texts = given.map((v) => (isCount || v === "none" ? v : number(v, decimals)));
    if (isTwo) {
      const isNumber = !isCount && given.every((value) => typeof value === "number");
      const change = given[1] - given[0];
      const turned = name.startsWith("heading") ? change - 360 * Math.round(change / 360) : change;
      texts.push(isNumber ? number(turned, decimals, "+") : "");
    }
    return row(element("th", { text: name, scope: "row" }), texts, "td");
  });
  const names = columns.map(({ name }) => name);
  if (isTwo) names.push(names.join() === "A,B" ? "B − A" : "difference");
  table.replaceChildren(row(element("td"), names, "th", { scope: "col" }), ...body);
}

/** All designs, fittest first; ties by number, and diverged designs last. */
export function ranking(fitness) {
  return fitness.map((_, i) => i).sort((a, b) => (fitness[b] ?? -1) - (fitness[a] ?? -1));
}

/** The fittest hundred, or fewer if more diverged; from a given ranking. */
export function topOf(fitness, order = ranking(fitness)) {
  return order.slice(0, TOP).filter((design) => fitness[design] !== null);
}

/** What changed between two landscapes: {best, former, lines}, in words. */
export function changesOf(before, now) {
  const [then, order] = [ranking(before), ranking(now)];
  const [best, former] = [order[0], then[0]];
  const top = new Set(topOf(before, then));
  const differences = now.flatMap((value, i) => (value === null ? [] : [value - before[i]]));
  const mean = differences.reduce((sum, value) => sum + value, 0) / differences.length;
  const diverged = now.length - differences.length;
  const lines = [`${topOf(now, order).filter((design) => top.has(design)).length} of the top ${TOP} stayed`];
  if (best === former) {
    lines.push(`★ ${best} is still the best: ${number(now[best])}`);
  } else {
    lines.push(`★ ${best} is the best now: ${number(now[best])}, was rank ${then.indexOf(best) + 1}`);
    const rank = order.indexOf(former) + 1;
    const fate = now[former] === null ? "it diverged" : `now rank ${rank}, ${number(now[former])}`;
    lines.push(`☆ ${former} was the best: ${fate}`);
  }
  lines.push(`mean change ${differences.length ? number(mean, 3, "+") : "unknown"} voxel widths`);
  if (diverged) lines.push(`${diverged} designs diverged (×)`);
  return { best, former, lines };
}

/** The designs of a path that were the best so far: [{design, at}]. */
export function improvements({ designs, fitness }) {
  let best = -1;
  return designs.flatMap((design, at) => {
    if ((fitness[at] ?? -1) <= best) return [];
    best = fitness[at];
    return [{ design, at }];
  });
}

/** The best of a path after some evaluations, {design, at}, or nothing. */
export function bestUpto({ best }, upto) {
  return best.filter(({ at }) => at < upto).at(-1);
}

/** Describe how far a path came. */
export function pathInShort(path, upto, atlas) {
  const best = bestUpto(path, upto);
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

/** What differs from the published physics. */
export function wordsOf(parameters) {
  const changes = Object.entries(parameters).map((change) => change.join(" ").replaceAll("_", " "));
  return `physics: ${changes.join(", ") || "as published"}`;
}

/** All designs with their current values, as CSV; the numbers are exact. */
export function csvOf(atlas, { dx, dy, fitness }) {
  const head = "design,digits,dx,dy,fitness,diverged,fitness_published,mean_under_noise";
  const rows = fitness.map((value, i) => {
    const diverged = value === null ? "True" : "False";
    return [i, digitsOf(i), dx[i], dy[i], value, diverged, atlas.fitness[i], atlas.noise[i]].join(",");
  });
  return new Blob([[head, ...rows, ""].join("\n")], { type: "text/csv" });
}
