// The page: what is seen is `state`, kept in the address; everything else follows from it.

import { SoftvoxPlayer } from "./player.js";
import { Controls } from "./controls.js";
import { colouring, drawScale } from "./colours.js";
import { LandscapeMap } from "./map.js";
import * as panels from "./panels.js";
import { digitsOf, drawRobot, Editor } from "./robot.js";
import { address, get, Refused, save, work } from "./server.js";
import { DEFAULTS, read, written } from "./state.js";

const find = (id) => document.getElementById(id);

class App {
  #state = read(location.hash);
  #atlas;
  #values; // the landscape now: {dx, dy, fitness}
  #applied = {}; // the parameters that it was computed with
  #searchers; // names, by the results that they are of; "" for live runs
  #robots = null;
  #path = null;
  #player = null;
  #newest = {}; // what is asked for, by kind: the newest request wins

  constructor(about, atlas) {
    this.#atlas = atlas;
    this.#values = atlas;
    this.controls = new Controls(find("sliders"), about, (parameters) => {
      this.#change({ parameters });
      this.#recompute();
    });
    this.map = new LandscapeMap(find("map"), atlas);
    this.editor = new Editor(find("editor"), (design) => this.#choose(design));
    this.#searchers = { "": about.searchers, ...about.results };
    const sources = Object.keys(about.results);
    find("results").append(new Option("a live run", ""), ...sources.map((s) => new Option(s, s)));
    find("results-row").hidden = !sources.length;
    find("budget").max = about.most_budget;
    find("version").textContent = `softvox-gym ${about.version}.`;
    this.#listen();
    this.#show();
  }

  /** Show what the state tells, all of it. */
  #show() {
    const { map, parameters, results, searcher, seed, budget } = this.#state;
    find("kind").value = map;
    this.controls.parameters = parameters;
    find("results").value = results;
    this.#offer(results);
    Object.entries({ searcher, seed, budget }).forEach(([name, value]) => (find(name).value = value));
    this.#paint();
    this.#recompute();
    if (searcher) this.#search();
    else this.#clearPath();
  }

  #change(changes) {
    Object.assign(this.#state, changes);
    history.replaceState(null, "", `#${written(this.#state)}`);
  }

  #listen() {
    const on = (id, type, handler) => find(id).addEventListener(type, handler);
    const onForm = (id, handler) =>
      on(id, "submit", (event) => {
        event.preventDefault();
        handler();
      });
    addEventListener("hashchange", () => {
      this.#state = read(location.hash);
      this.#show();
    });
    on("map", "point", ({ detail }) => this.#hover(detail.design));
    on("map", "pick", ({ detail }) => this.#choose(detail.design));
    onForm("find", () => this.#choose(find("find-text").value.trim()));
    on("end-compare", "click", () => this.#endComparison());
    on("kind", "change", () => {
      this.#change({ map: find("kind").value });
      this.#paint();
    });
    on("reset", "click", () => {
      this.controls.parameters = {};
      this.#change({ parameters: {} });
      this.#recompute();
    });
    onForm("path", () => {
      const fields = ["results", "searcher", "seed", "budget"].map((name) => [name, find(name).value]);
      this.#change(Object.fromEntries(fields));
      this.#search();
    });
    on("results", "change", () => {
      const { value } = find("results");
      this.#offer(value);
      find("seed").value = value ? "0" : DEFAULTS.seed;
    });
    on("clear-path", "click", () => {
      find("searcher").value = "";
      const { seed, budget } = DEFAULTS;
      this.#change({ results: "", searcher: "", seed, budget });
      this.#clearPath();
    });
    on("upto", "input", () => this.#showPath());
    on("save-csv", "click", () => this.#saveCsv());
    on("save-png", "click", () => this.#savePng());
    on("share", "click", () => this.#share());
  }

  /** Ask for something that replaces what was asked for of its kind; null where replaced itself. */
  async #ask(kind, request) {
    this.#newest[kind]?.abort();
    const mine = new AbortController();
    this.#newest[kind] = mine;
    try {
      const answer = await request(mine.signal);
      return this.#newest[kind] === mine ? answer : null;
    } catch (error) {
      if (this.#newest[kind] === mine) throw error;
      return null;
    }
  }

  #complain(error) {
    if (!(error instanceof Refused)) throw error;
    const isShown = this.controls.complain(error.parameter, error.message);
    if (!isShown) find("message").textContent = error.message;
  }

  // The robot

  #hover(design) {
    drawRobot(find("hover-robot"), digitsOf(design));
    find("hover-text").textContent = panels.inShort(design, this.#atlas, this.#values);
  }

  #choose(design) {
    const which = document.querySelector("#which input:checked").value;
    return this.#simulate({ [which]: String(design) });
  }

  #endComparison() {
    document.querySelector('#which input[value="design"]').checked = true;
    this.#simulate({ compare: "" });
  }

  /** Simulate the robots of the state, with changes; it takes these on if they can be. */
  async #simulate(changes = {}) {
    const { design, compare } = { ...this.#state, ...changes };
    const query = { design, ...(compare && { compare }), ...this.#applied };
    try {
      const told = await this.#ask("robots", (signal) => get("/api/robots", query, signal));
      if (!told) return;
      if (this.#robots) find("message").textContent = "";
      this.#change(changes);
      this.#showRobots(told, query);
    } catch (error) {
      this.#complain(error);
      // An address with a wrong design still gets a robot, beside the message.
      const standard = { design: DEFAULTS.design, compare: "" };
      if (!this.#robots && design !== standard.design) await this.#simulate(standard);
    }
  }

  #showRobots({ robots, recording }, query) {
    const [design, compare = null] = robots.map((robot) => robot.design);
    const isB = document.querySelector("#which input:checked").value === "compare";
    const edited = isB && compare !== null ? compare : design;
    this.#robots = robots;
    this.map.mark({ design, compare });
    this.editor.show(digitsOf(edited));
    find("find-text").value = edited;
    find("end-compare").hidden = compare === null;
    find("save-replay").href = address("/api/replay.html", query);
    panels.fillFacts(find("facts"), robots, this.#atlas, this.#values);
    this.#play(recording, query);
    find("robot-panel").dataset.designs = [design, compare].filter((d) => d !== null).join(" ");
  }

  #play(recording, query) {
    const place = find("player");
    const first = !this.#player;
    this.#player ??= new SoftvoxPlayer(place);
    if (this.#player.supported) {
      this.#player.load(recording);
      const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (first && !isStill) this.#player.play();
      return;
    }
    const picture = place.querySelector("img") ?? place.appendChild(new Image());
    picture.alt = `At the end: ${recording.robots.map((robot) => robot.label).join("; ")}`;
    picture.src = address("/api/still.png", query);
  }

  // The landscape

  async #recompute() {
    const { parameters } = this.#state;
    const isPublished = Object.keys(parameters).length === 0;
    this.#progress(0, 6561);
    try {
      const told = await this.#ask("landscape", (signal) =>
        work("/api/landscape", { parameters }, signal, (...far) => this.#progress(...far)),
      );
      if (!told) return;
      this.#values = told.values;
      this.#applied = parameters;
      this.controls.complain(null, "");
      find("message").textContent = "";
      panels.fillChanges(find("changes"), told.changes, told.warnings, isPublished);
      const { best, best_before: before } = told.changes;
      this.map.showBest(isPublished ? null : { from: before.design, to: best.design });
      this.#paint();
      this.#progress(null);
      await this.#simulate();
    } catch (error) {
      this.#progress(null);
      this.#complain(error);
      this.#change({ parameters: this.#applied });
      if (!this.#robots) await this.#simulate();
    }
    document.body.dataset.parameters = JSON.stringify(this.#applied);
  }

  #progress(done, total) {
    const row = find("progress-row");
    row.hidden = done === null;
    if (done === null) return;
    find("progress").value = done / total;
    find("progress-text").textContent = `${done} of ${total} designs`;
  }

  #paint() {
    const { colour, scale, low, high, unit } = colouring(this.#state.map, this.#atlas, this.#values);
    this.map.paint(colour);
    drawScale(find("scale"), scale);
    Object.entries({ low, high, unit }).forEach(([id, text]) => (find(id).textContent = text));
  }

  // A searcher's path

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

  async #search() {
    const { results, searcher, seed, budget } = this.#state;
    if (!searcher) return this.#clearPath();
    const asked = { results, searcher, seed, budget };
    const bar = find("path-progress");
    bar.hidden = false;
    bar.removeAttribute("value");
    find("path-text").textContent = "";
    try {
      const path = await this.#ask("path", (signal) =>
        work("/api/path", asked, signal, (done, total) => (bar.value = done / total)),
      );
      if (!path) return;
      this.#path = { ...path, best: panels.improvements(path) };
      const upto = find("upto");
      upto.max = path.designs.length;
      upto.value = path.designs.length;
      find("upto-row").hidden = false;
      this.#showPath();
    } catch (error) {
      this.#clearPath();
      if (!(error instanceof Refused)) throw error;
      find("path-text").textContent = error.message;
    }
    bar.hidden = true;
  }

  #showPath() {
    const upto = Number(find("upto").value);
    this.map.showPath({ ...this.#path, upto });
    find("path-text").textContent = panels.pathInShort(this.#path, upto, this.#atlas);
  }

  #clearPath() {
    this.#newest.path?.abort();
    this.#newest.path = null;
    this.#path = null;
    this.map.showPath(null);
    find("upto-row").hidden = true;
    find("path-progress").hidden = true;
    find("path-text").textContent = "";
  }

  // To keep and to share

  #saveCsv() {
    const table = panels.asCsv(this.#atlas, this.#values);
    save(new Blob([table], { type: "text/csv" }), "landscape.csv");
  }

  #savePng() {
    const [map, scale] = [find("map"), find("scale")];
    const all = Object.assign(document.createElement("canvas"), { width: 680, height: 730 });
    const pen = all.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, all.width, all.height);
    pen.drawImage(map, 16, 16);
    pen.drawImage(scale, 16, 676, map.width, 14);
    pen.fillStyle = "#1a1f29";
    pen.font = "15px system-ui, sans-serif";
    for (const [id, align, x] of [["low", "left", 16], ["unit", "center", 340], ["high", "right", 664]]) {
      pen.textAlign = align;
      pen.fillText(find(id).textContent, x, 712);
    }
    all.toBlob((blob) => save(blob, `landscape-${this.#state.map}.png`));
  }

  async #share() {
    const said = await navigator.clipboard.writeText(location.href).then(
      () => "The link is copied.",
      () => "The link is this page's address.",
    );
    find("message").textContent = said;
  }
}

try {
  const [about, atlas] = await Promise.all([get("/api/about"), get("/api/atlas")]);
  new App(about, atlas);
} catch (error) {
  find("message").textContent = error.message;
  throw error;
}
