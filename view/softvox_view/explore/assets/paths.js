// Searchers' paths: the form for them, their playback, and their comparison.

import { drawCurves, markerOf } from "./curve.js";
import { element, find, latest, unpacked } from "./page.js";
import { bestUpto, improvements, pathInShort, rankOf } from "./panels.js";
import { Refused } from "./physics.js";
import { search, SEARCHERS } from "./search.js";

/** In the address: the path asked for last, and in `also` the ones beside it. */
export const NO_PATH = { results: "", searcher: "", seed: "1", budget: "100", also: "" };

const ASKED = ["searcher", "seed", "budget", "results"]; // the fields of a path, in the order of `also`
const COLOURS = ["#d55e00", "#0084c8", "#009e73", "#b35fa0"]; // also the limit of paths shown together
const PLAY_SECONDS = 8; // for all evaluations,
const SLOWEST = 4; // but at least this many per second

const askedOf = (fields) => Object.fromEntries(ASKED.map((name) => [name, fields[name] ?? ""]));
const isAsked = (a, b) => ASKED.every((name) => a[name] === b[name]);

/** Paths as `also` has them: random.2.100*hill_climber.3.100.folder; separators are escaped. */
function alsoOf(paths) {
  const plain = (text) => encodeURIComponent(text).replaceAll(".", "%2E").replaceAll("*", "%2A");
  return paths.map(({ fields }) => ASKED.map((name) => plain(fields[name])).join(".").replace(/\.$/, "")).join("*");
}

function readAlso(text) {
  try {
    const paths = text.split("*").filter(Boolean).map((path) => path.split(".").map(decodeURIComponent));
    return paths.map((parts) => askedOf(Object.fromEntries(ASKED.map((name, k) => [name, parts[k]]))));
  } catch {
    throw new Refused(`also=${text} is no list of paths`);
  }
}

const titleOf = ({ fields: { results, searcher, seed } }) =>
  [searcher, `seed ${seed}`, results].filter(Boolean).join(", ");

export class Paths {
  #results;
  #fitness;
  #onShow;
  #onWish;
  #all = []; // the newest last
  #moveCursor;
  #playing = 0; // the number of an animation frame, or 0

  /** onShow({paths, upto}) shows paths; onWish(fields) gets what the form asked for. */
  constructor(results, fitness, onShow, onWish) {
    [this.#results, this.#fitness, this.#onShow, this.#onWish] = [results, fitness, onShow, onWish];
    const on = (id, type, handler) => find(id).addEventListener(type, handler);
    on("path", "submit", (event) => {
      event.preventDefault();
      this.#wish(this.#all.slice(0, -1));
    });
    on("add-path", "click", () => this.#wish(this.#all));
    on("clear-path", "click", () => this.show(NO_PATH, true));
    on("results", "change", ({ target: { value } }) => {
      this.#offer(value);
      find("seed").value = value ? "0" : NO_PATH.seed;
    });
    on("upto", "input", () => {
      this.#stop();
      this.#draw();
    });
    on("play-path", "click", () => (this.#playing ? this.#stop() : this.#play()));
    const options = Object.keys(results).map((name) => new Option(name, name));
    find("results").append(new Option("a live run", ""), ...options);
    find("results-row").hidden = !options.length;
  }

  /**
   * Show the paths that fields describe. If the form asked for them, the address changes once they are
   * there; if they can't be had, all stays as it was.
   */
  async show(fields, isOfForm) {
    this.#offer(fields.results);
    for (const name of ASKED) find(name).value = fields[name];
    try {
      const asked = fields.searcher ? [...readAlso(fields.also), askedOf(fields)] : [];
      const found = await latest("path", this.#found(asked));
      if (found.length !== this.#all.length || found.some((path, k) => path !== this.#all[k])) this.#take(found);
      this.#draw();
      if (isOfForm) this.#onWish(fields);
    } catch (error) {
      if (!isOfForm) this.#take([]);
      this.#draw();
      find("path-text").textContent = error.message;
    }
  }

  /** Ask for the form's path, beside those that are kept. */
  #wish(kept) {
    const asked = askedOf(Object.fromEntries(new FormData(find("path"))));
    if (kept.some(({ fields }) => isAsked(fields, asked))) {
      find("path-text").textContent = "This path is shown already: choose another seed, budget or searcher.";
    } else this.show({ ...asked, also: asked.searcher && alsoOf(kept) }, true);
  }

  async #found(asked) {
    if (asked.length > COLOURS.length) throw new Refused(`${COLOURS.length} paths at a time, got ${asked.length}`);
    return Promise.all(asked.map(async (fields) => {
      const there = this.#all.find((path) => isAsked(path.fields, fields));
      if (there) return there;
      const found = await this.#search(fields);
      return { ...found, fields, rank: rankOf(this.#fitness, found.recommended), best: improvements(found) };
    }));
  }

  /** Run a searcher, or look up a recorded run. */
  async #search({ results: folder, searcher, ...numbers }) {
    for (const [name, least, most] of [["seed", 0, 1e15], ["budget", 1, 2000]]) {
      const number = (numbers[name] = Number(numbers[name] || NaN));
      if (!Number.isInteger(number) || number < least || number > most) {
        throw new Refused(`${name} must be a whole number from ${least} to ${most}, got ${number}`, name);
      }
    }
    if (folder && !Object.hasOwn(this.#results, folder)) {
      throw new Refused(`results '${folder}' are not there; softvox explore --results DIR adds some`);
    }
    const there = folder ? this.#results[folder] : SEARCHERS;
    if (!Object.hasOwn(there, searcher)) {
      throw new Refused(`searcher '${searcher}' is not among ${Object.keys(there).join(", ")}`);
    }
    if (!folder) return search(searcher, numbers, this.#fitness);
    const run = there[searcher][numbers.seed];
    if (!run) throw new Refused(`seed ${numbers.seed} was not recorded: there are ${Object.keys(there[searcher]).length} seeds`);
    const [designs, fitness] = await Promise.all([run.designs, run.fitness].map(unpacked));
    return {
      ...run,
      designs: [...new Uint16Array(designs)].slice(0, numbers.budget),
      fitness: [...new Float64Array(fitness)].slice(0, numbers.budget).map((v) => (v === v ? v : null)),
    };
  }

  /** Offer the searchers of some results, or those that run in the page. */
  #offer(folder) {
    const names = Object.keys((folder ? this.#results[folder] : SEARCHERS) ?? {});
    find("searcher").replaceChildren(new Option("none", ""), ...names.map((s) => new Option(s, s)));
    find("search").textContent = folder ? "Show" : "Search";
    find("path-source").textContent = folder
      ? "A recorded run; the budget is the number of evaluations shown."
      : "A live run, on the published landscape.";
  }

  #take(found) {
    this.#stop();
    this.#all = found;
    found.forEach((path, k) => (path.colour = COLOURS[k]));
    find("path-shown").hidden = !found.length;
    if (!found.length) return;
    find("upto").max = Math.max(...found.map(({ designs }) => designs.length));
    find("upto").value = find("upto").max;
    this.#moveCursor = drawCurves(find("curve"), found, this.#fitness);
    find("path-list").replaceChildren(...found.map((path, k) => this.#row(path, k)));
  }

  #row(path, k) {
    const icon = { width: 14, height: 14, viewBox: "-1.7 -1.7 3.4 3.4", "aria-hidden": "true" };
    const button = element("button", { type: "button", text: "×", "aria-label": `remove ${titleOf(path)}` });
    button.addEventListener("click", () => {
      const left = this.#all.toSpliced(k, 1);
      const newest = left.pop();
      this.show(newest ? { ...newest.fields, also: alsoOf(left) } : NO_PATH, true);
    });
    const shape = element("svg:svg", icon, markerOf(k, { fill: path.colour }));
    return element("li", { class: "bar" }, shape, element("output"), button);
  }

  #draw() {
    const upto = Number(find("upto").value);
    this.#onShow({ paths: this.#all, upto });
    const newest = this.#all.at(-1);
    const told = newest && pathInShort(newest, Math.min(upto, newest.designs.length), { fitness: this.#fitness });
    find("path-text").textContent = told ?? "";
    if (!newest) return;
    this.#moveCursor(upto);
    const optimum = Math.max(...this.#fitness);
    find("path-list").querySelectorAll("output").forEach((row, k) => {
      const best = this.#fitness[bestUpto(this.#all[k], upto)?.design];
      const words = best === undefined ? "none yet" : `${best.toFixed(2)}, regret ${(optimum - best).toFixed(2)}`;
      row.textContent = `${titleOf(this.#all[k])}: best ${words}`;
    });
  }

  /** Play from the slider's position, or from the start if it is at the end. */
  #play() {
    const slider = find("upto");
    const most = Number(slider.max);
    const from = Number(slider.value) < most ? Number(slider.value) : 1;
    const pace = Math.max(most / PLAY_SECONDS, SLOWEST) / 1000;
    let begun = null;
    const step = (now) => {
      begun ??= now;
      slider.value = Math.min(most, from + Math.floor((now - begun) * pace));
      this.#draw();
      if (Number(slider.value) < most) this.#playing = requestAnimationFrame(step);
      else this.#stop();
    };
    this.#playing = requestAnimationFrame(step);
    find("play-path").textContent = "❚❚ pause";
  }

  #stop() {
    cancelAnimationFrame(this.#playing);
    this.#playing = 0;
    find("play-path").textContent = "▶ play";
  }
}
