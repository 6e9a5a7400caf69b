// A searcher's path over the map: its form, and what it shows of it.

import { find } from "./dom.js";
import { improvements, pathInShort } from "./panels.js";
import { compute, Newest, Refused } from "./server.js";
import { DEFAULTS, PATH } from "./state.js";

/** The form of paths; calls onChange(fields) when it has brought another one, or none. */
export class PathPanel {
  #atlas;
  #map;
  #searchers; // names, by the results that they are of; "" for live runs
  #asked = new Newest();
  #onChange;
  #path = null;

  constructor({ searchers, results, most_budget }, atlas, map, onChange) {
    this.#atlas = atlas;
    this.#map = map;
    this.#searchers = { "": searchers, ...results };
    const sources = Object.keys(results);
    find("results").append(new Option("a live run", ""), ...sources.map((s) => new Option(s, s)));
    find("results-row").hidden = !sources.length;
    find("budget").max = most_budget;
    this.#onChange = onChange;
    this.#listen();
  }

  /**
   * Show the path that fields tell: results, searcher, seed, budget. Where the form asked for it,
   * the address takes it on once it is there, and what can't be had leaves all as it was.
   */
  show(fields, isOfForm = false) {
    find("results").value = fields.results;
    this.#offer(fields.results);
    for (const name of ["searcher", "seed", "budget"]) find(name).value = fields[name];
    const isSeen = fields.searcher && PATH.every((name) => this.#path?.fields[name] === fields[name]);
    if (fields.searcher && !isSeen) {
      this.#search(fields, isOfForm);
      return;
    }
    if (isSeen) this.#keep();
    else this.#clear();
    if (isOfForm) this.#onChange(fields);
  }

  #listen() {
    find("path").addEventListener("submit", (event) => {
      event.preventDefault();
      const fields = Object.fromEntries(PATH.map((name) => [name, find(name).value]));
      this.show(fields, true);
    });
    find("results").addEventListener("change", ({ target: { value } }) => {
      this.#offer(value);
      find("seed").value = value ? "0" : DEFAULTS.seed;
    });
    find("clear-path").addEventListener("click", () => {
      const fields = Object.fromEntries(PATH.map((name) => [name, DEFAULTS[name]]));
      this.show(fields, true);
    });
    find("upto").addEventListener("input", () => this.#draw());
  }

  /** Offer the searchers of some results, or those that can run live. */
  #offer(results) {
    const names = this.#searchers[results] ?? [];
    find("searcher").replaceChildren(new Option("none", ""), ...names.map((s) => new Option(s, s)));
    const isLive = !results;
    find("search").textContent = isLive ? "Search" : "Show";
    find("path-source").textContent = isLive
      ? "A live run, on the published landscape."
      : "Recorded; the budget is how many evaluations are shown.";
  }

  async #search({ results, searcher, seed, budget }, isOfForm) {
    const bar = find("path-progress");
    const asked = { results, searcher, seed, budget };
    bar.hidden = false;
    bar.removeAttribute("value");
    find("path-text").textContent = "";
    try {
      const path = await this.#asked.ask((signal) =>
        compute("/api/path", asked, signal, (done, total) => (bar.value = done / total)),
      );
      if (!path) return; // a newer one is under way, and the bar is its own
      this.#path = { ...path, fields: asked, best: improvements(path) };
      const upto = find("upto");
      upto.max = path.designs.length;
      upto.value = path.designs.length;
      find("upto-row").hidden = false;
      this.#draw();
      if (isOfForm) this.#onChange(asked);
    } catch (error) {
      if (!isOfForm) this.#clear();
      find("path-text").textContent = error.message;
      if (!(error instanceof Refused)) reportError(error);
    }
    bar.hidden = true;
  }

  /** Stay with the path that is seen, whatever else was asked for meanwhile. */
  #keep() {
    this.#asked.cancel();
    find("path-progress").hidden = true;
    this.#draw();
  }

  #draw() {
    const upto = Number(find("upto").value);
    this.#map.show({ path: { ...this.#path, upto } });
    find("path-text").textContent = pathInShort(this.#path, upto, this.#atlas);
  }

  #clear() {
    this.#asked.cancel();
    this.#path = null;
    this.#map.show({ path: null });
    find("upto-row").hidden = true;
    find("path-progress").hidden = true;
    find("path-text").textContent = "";
  }
}
