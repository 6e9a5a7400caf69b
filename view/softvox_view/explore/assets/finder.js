// The designs to look at: filters, the fittest designs that pass, and a random one.

import { between, heading } from "./colours.js";
import { element, find } from "./page.js";
import { digitsOf, drawRobot } from "./robot.js";

/** Filters as in the address; "" lets all pass. */
export const FILTERS = { voxels: "", active: "", towards: "", robust: "", each: "", tried: "" };
const SECTOR = 22.5; // degrees to both sides of a heading
const PAGE = 12; // robots

/** Return which designs pass, as an array of true and false. */
export function passing(filters, { counts, noise, fitness: published, tried }, { dx, dy, fitness }) {
  const { voxels, active, towards, robust } = filters;
  const turn = (i) => between(heading(dx[i], dy[i]), Number(towards)) ?? Infinity;
  return fitness.map((_, i) => {
    const [there, pumped] = counts[i];
    if (voxels && there !== Number(voxels)) return false;
    if (active && pumped !== Number(active)) return false;
    if (filters.tried && tried.length && !tried.includes(i)) return false;
    if (towards && turn(i) > SECTOR) return false;
    return !robust || (published[i] > 0 && noise[i] / published[i] >= Number(robust));
  });
}

/** Return the number of voxels of designs, and of active voxels. */
export function countsOf(designs) {
  return designs.map((design) => {
    const digits = digitsOf(design);
    return [digits.replaceAll("0", "").length, digits.replace(/[01]/g, "").length];
  });
}

/** Return the designs that pass, fittest first; if classes are given, only the first of each class. */
export function leadersOf(ranking, passes, classes) {
  const told = new Set();
  return ranking.filter((design) => {
    if (!passes[design] || (classes && told.has(classes[design]))) return false;
    if (classes) told.add(classes[design]);
    return true;
  });
}

/** The panel: it calls onFilter(filters) when a filter changes, onPick(design) when a robot is chosen. */
export class Finder {
  #form = find("filters");
  #all = []; // the designs that pass, fittest first
  #shown = PAGE;

  constructor(onFilter, onPick) {
    const numbers = Array.from({ length: 9 }, (_, n) => new Option(n, n));
    for (const name of ["voxels", "active"]) this.#form[name].append(...numbers.map((o) => o.cloneNode(true)));
    this.#form.addEventListener("change", () => onFilter(this.filters));
    find("random").addEventListener("click", () => {
      if (this.#all.length) onPick(this.#all[Math.floor(Math.random() * this.#all.length)]);
    });
    find("more").addEventListener("click", () => this.#draw((this.#shown += PAGE)));
    find("leaders").addEventListener("click", ({ target }) => {
      const button = target.closest("button");
      if (button) onPick(button.dataset.design);
    });
  }

  get filters() {
    return { ...FILTERS, ...Object.fromEntries(new FormData(this.#form)) };
  }

  /** Set filters; return the names of invalid ones. */
  set(filters) {
    return Object.keys(FILTERS).filter((name) => {
      const field = this.#form[name];
      if (field.type === "checkbox") field.checked = filters[name] === field.value;
      else field.value = filters[name];
      return filters[name] && this.filters[name] !== filters[name];
    });
  }

  /** Show the fittest of all that pass; the list is sorted, fittest first. */
  show(all, fitness, total) {
    this.#all = all;
    this.fitness = fitness;
    find("passing").textContent = `${total} of ${fitness.length} designs pass`;
    find("passing").hidden = total === fitness.length;
    this.#draw((this.#shown = PAGE));
  }

  #draw() {
    const cards = this.#all.slice(0, this.#shown).map((design, k) => {
      const value = this.fitness[design]?.toFixed(2) ?? "diverged";
      const svg = element("svg:svg", { viewBox: "-1.7 -1.9 3.4 3.3", "aria-hidden": "true" });
      drawRobot(svg, digitsOf(design));
      const name = `${k + 1}: design ${design}, fitness ${value}`;
      const words = [element("b", { text: design }), element("span", { text: value })];
      const button = { type: "button", "data-design": design, "aria-label": name };
      return element("li", {}, element("button", button, svg, ...words));
    });
    find("leaders").replaceChildren(...cards);
    find("more").hidden = this.#all.length <= this.#shown;
  }
}
