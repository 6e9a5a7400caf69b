// The explanation of the map's colours, and their options: by value or rank, a locked scale.

import { colouring, drawScale } from "./colours.js";
import { element, find } from "./page.js";
import { TOP } from "./panels.js";
import { Refused } from "./physics.js";

/** In the address: colours by value or rank, "group:top" of a locked scale, how many are outlined. */
export const NO_SCALE = { by: "value", lock: "", outline: "" };

const GROUPS = { fitness: "fitness", noise: "fitness", difference: "difference" }; // maps with a common scale
const RANKED = ["fitness", "noise"]; // ranks of differences would hide that there are none
const EXPLAINED = "Bars: number of designs, on a log scale.";
const BINS = 64;
const SECTORS = 36;
const ALLOWED = { by: /^(value|rank)$/, lock: /^((fitness|difference):(?![0.]+$)\d+(\.\d+)?)?$/, outline: /^(100)?$/ };

/** Checks of parts of the address: each returns the text, or throws if it is invalid. */
export const scaleChecks = Object.fromEntries(
  Object.entries(ALLOWED).map(([name, allowed]) => [name, (text) => {
    if (allowed.test(text)) return text;
    throw new Refused(`${name}=${text} is no scale of the map`);
  }]),
);

export class Legend {
  #before = {}; // by group: where the scale ended, and the text about it
  #now = null;

  /** Changes of the address go to onChange(changes). */
  constructor(onChange) {
    const told = {
      by: ({ value }) => value,
      lock: ({ checked }) => (checked ? `${this.#now.group}:${this.#now.top}` : ""),
      outline: ({ checked }) => (checked ? String(TOP) : ""),
    };
    for (const [name, of] of Object.entries(told)) {
      find(name).addEventListener("change", ({ target }) => onChange({ [name]: of(target) }));
    }
  }

  /** Return how to paint the map, and explain it; a draft leaves no lasting text. */
  show({ map, by, lock, outline }, atlas, values, isDraft) {
    const group = GROUPS[map];
    const [lockedGroup, lockedTop] = lock.split(":");
    const isLocked = group !== undefined && lockedGroup === group;
    const made = colouring(map, atlas, values, {
      by: RANKED.includes(map) ? by : "value",
      top: isLocked ? Number(lockedTop) : undefined,
    });
    // Rounded up, so that the address is short and no value lies above.
    this.#now = { group, top: Math.ceil(made.range[1] * 1e4) / 1e4 };
    Object.assign(find("by"), { value: by, disabled: !RANKED.includes(map) });
    Object.assign(find("lock"), { checked: isLocked, disabled: !group || !this.#now.top });
    find("outline").checked = Boolean(outline);
    for (const id of ["low", "high", "unit"]) find(id).textContent = made[id];
    find("scale-note").textContent = this.#note(made, group, isLocked, isDraft);
    const isCyclic = map === "heading";
    find("legend").classList.toggle("cyclic", isCyclic);
    drawScale(find("scale"), made.scale);
    if (isCyclic) drawRing(find("ring").firstElementChild, made.scale, binned(made, SECTORS));
    else find("histogram").firstElementChild.setAttribute("d", histogram(binned(made, BINS)));
    return made;
  }

  #note({ shown, range }, group, isLocked, isDraft) {
    if (!group) return "Arrows: mean travel of each square. Ring: how many designs head each way.";
    if (isLocked) {
      const beyond = shown.filter((value) => Math.abs(value) > range[1]).length;
      return `The scale is locked${beyond ? `; ${beyond} designs are beyond it` : ""}.`;
    }
    const before = this.#before[group];
    if (!isDraft && before?.top !== range[1]) {
      const isTold = before?.top && range[1];
      const words = isTold ? `Rescaled: it ended at ${before.top.toFixed(2)} before.` : EXPLAINED;
      this.#before[group] = { top: range[1], words };
    }
    return this.#before[group]?.words ?? EXPLAINED;
  }
}

/** The number of values in each part of the range; those beyond it count in the last. */
function binned({ shown, range: [low, high] }, bins) {
  const counts = new Array(bins).fill(0);
  for (const value of shown) {
    if (!Number.isFinite(value)) continue;
    const bin = Math.floor((bins * (value - low)) / (high - low || 1));
    counts[Math.min(Math.max(bin, 0), bins - 1)]++;
  }
  return counts;
}

/** A path, as wide as there are counts and 1 high; logarithmic, so that one among thousands is visible. */
function histogram(counts) {
  const most = Math.log1p(Math.max(...counts, 1));
  return `M0 1${counts.map((count, i) => `V${1 - Math.log1p(count) / most}H${i + 1}`).join("")}V1Z`;
}

/** Draw the key of headings: a ring of their colours, and in it the number of designs per heading. */
function drawRing(parent, scale, counts) {
  const most = Math.max(...counts, 1);
  const corner = (k, r) => [-r * Math.cos((2 * Math.PI * k) / SECTORS), r * Math.sin((2 * Math.PI * k) / SECTORS)];
  const sector = (k, from, to, fill) => {
    const points = [corner(k, from), corner(k + 1, from), corner(k + 1, to), corner(k, to)].join(" ");
    return element("svg:polygon", { points, fill, stroke: fill, "stroke-width": 0.02 });
  };
  const sectors = counts.flatMap((count, k) => [
    sector(k, 0.72, 1, `rgb(${scale((k + 0.5) / SECTORS).map(Math.round).join(" ")})`),
    sector(k, 0, (0.64 * count) / most, "currentColor"),
  ]);
  parent.replaceChildren(...sectors);
}
