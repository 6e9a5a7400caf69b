// The page. `#state` is what is seen, and is kept in the address; `#wanted` is what was asked for
// last, and becomes part of the state once the server has answered.

import { SoftvoxPlayer } from "/player/player.js";
import { Controls } from "./controls.js";
import { colouring, drawScale } from "./colours.js";
import { element, find } from "./dom.js";
import { csvOf, nameOf, pictureOf } from "./downloads.js";
import { LandscapeMap } from "./map.js";
import * as panels from "./panels.js";
import { PathPanel } from "./path.js";
import { digitsOf, drawRobot, Editor } from "./robot.js";
import { address, compute, get, Newest, Refused, save } from "./server.js";
import { DEFAULTS, KINDS, PATH, read, wordsOf, written } from "./state.js";

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

class App {
  #state = { ...DEFAULTS, parameters: {} };
  #wanted = this.#state; // {design, compare, parameters}
  #atlas;
  #values; // the landscape now: {dx, dy, fitness}
  #robots = null;
  #player = null;
  #asked = { robots: new Newest(), landscape: new Newest() };

  constructor(about, atlas) {
    this.#atlas = atlas;
    this.#values = atlas;
    this.controls = new Controls(find("sliders"), about, (parameters) => this.#set(parameters));
    this.map = new LandscapeMap(find("map"), atlas);
    this.path = new PathPanel(about, atlas, this.map, (fields) => this.#record(fields));
    this.editor = new Editor(find("editor"), (design) => this.#choose(design));
    find("version").textContent = `softvox-gym ${about.version}.`;
    // On a narrow screen the robot itself comes first.
    find("drawing").open = matchMedia("(min-width: 721px)").matches;
    this.#listen();
    this.#show();
  }

  /** Show what the address tells, all of it. */
  #show() {
    const { map, design, compare, parameters, ...path } = read(location.hash);
    const isKnown = KINDS.includes(map);
    this.#state.map = isKnown ? map : DEFAULTS.map;
    find("message").textContent = isKnown ? "" : `there is no map ${map}; the maps are ${KINDS.join(", ")}`;
    find("kind").value = this.#state.map;
    for (const name of PATH) this.#state[name] = path[name];
    this.path.show(path);
    this.controls.parameters = parameters;
    this.#paint();
    this.#wanted = { design, compare, parameters };
    if (!same(parameters, this.#state.parameters)) return this.#recompute(false);
    this.#asked.landscape.cancel();
    this.#progress(null);
    return this.#simulate(false);
  }

  /** Take on what is seen now; a step is one that the browser's Back undoes. */
  #record(changes = {}, isStep = true) {
    Object.assign(this.#state, changes);
    const now = written(this.#state);
    const isNew = now !== written(read(location.hash));
    history[isNew && isStep ? "pushState" : "replaceState"](null, "", `#${now}`);
  }

  #listen() {
    const on = (id, type, handler) => find(id).addEventListener(type, handler);
    addEventListener("hashchange", () => this.#show());
    on("map", "point", ({ detail }) => this.#hover(detail.design));
    on("map", "pick", ({ detail }) => this.#choose(detail.design));
    on("find", "submit", (event) => {
      event.preventDefault();
      this.#choose(find("find-text").value.trim());
    });
    on("which", "change", () => this.#showEdited());
    on("end-compare", "click", () => this.#endComparison());
    on("kind", "change", () => {
      this.#record({ map: find("kind").value });
      this.#paint();
    });
    on("reset", "click", () => {
      this.controls.parameters = {};
      this.#set({});
    });
    on("save-csv", "click", () => this.#saveCsv());
    on("save-png", "click", () => this.#savePng());
    on("share", "click", () => this.#share());
  }

  #complain(error) {
    const isShown = this.controls.complain(error.parameter, error.message);
    if (!isShown) find("message").textContent = error.message;
    if (!(error instanceof Refused)) reportError(error);
  }

  // The robot

  #hover(design) {
    drawRobot(find("hover-robot"), digitsOf(design));
    find("hover-text").textContent = panels.inShort(design, this.#atlas, this.#values);
  }

  get #which() {
    return document.querySelector("#which input:checked").value;
  }

  #choose(design) {
    find("message").textContent = "";
    this.#wanted = { ...this.#wanted, [this.#which]: String(design) };
    return this.#simulate();
  }

  #endComparison() {
    document.querySelector('#which input[value="design"]').checked = true;
    this.#wanted = { ...this.#wanted, compare: "" };
    this.#simulate();
  }

  /** Simulate the robots that are wanted; where one can't be, the one that is seen stays. */
  async #simulate(isStep = true) {
    const { design, compare } = this.#wanted;
    const query = { design, ...(compare && { compare }), ...this.#state.parameters };
    try {
      const answer = await this.#asked.robots.ask((signal) => get("/api/robots", query, signal));
      if (!answer) return;
      const [a, b = ""] = answer.robots.map((robot) => String(robot.design));
      this.#wanted = { ...this.#wanted, design: a, compare: b };
      this.#record({ design: a, compare: b }, isStep);
      this.#showRobots(answer, query);
    } catch (error) {
      this.#complain(error);
      const seen = { design: this.#state.design, compare: this.#state.compare };
      const isOne = error.parameter in seen;
      const kept = isOne ? { [error.parameter]: seen[error.parameter] } : seen;
      this.#wanted = { ...this.#wanted, ...kept };
      const isBehind = !this.#robots || !same(seen, { design, compare, ...kept });
      if (isOne && isBehind) await this.#simulate(isStep);
      else this.#record({}, false);
    }
  }

  #showRobots({ robots, recording }, query) {
    const { design, compare, parameters } = this.#state;
    this.#robots = robots;
    this.map.show({ marks: { design, compare } });
    this.#showEdited();
    find("end-compare").hidden = !compare;
    find("save-replay").href = address("/api/replay.html", query);
    panels.fillFacts(find("facts"), robots, this.#atlas, this.#values);
    this.#play(recording, query);
    find("robot-panel").dataset.designs = `${design} ${compare}`.trim();
    document.body.dataset.parameters = JSON.stringify(parameters);
  }

  /** Show the robot that the next click changes where it can be drawn and named. */
  #showEdited() {
    const design = this.#state[this.#which] || this.#state.design;
    this.editor.show(digitsOf(Number(design)));
    find("find-text").value = design;
  }

  #play(recording, query) {
    const first = !this.#player;
    this.#player ??= new SoftvoxPlayer(find("player"));
    this.#player.load(recording, address("/api/still.png", query));
    if (first) this.#player.autoplay();
  }

  // The landscape

  #set(parameters) {
    find("message").textContent = "";
    this.#wanted = { ...this.#wanted, parameters };
    this.#recompute();
  }

  /** Compute the landscape that is wanted, then the robots on it. */
  async #recompute(isStep = true) {
    const { parameters } = this.#wanted;
    this.#progress(0, 6561);
    try {
      const answer = await this.#asked.landscape.ask((signal) =>
        compute("/api/landscape", parameters, signal, (...far) => this.#progress(...far)),
      );
      if (!answer) return; // a newer one is under way, and the bar is its own
      this.#record({ parameters }, isStep);
      this.#showLandscape(answer);
    } catch (error) {
      this.#wanted = { ...this.#wanted, parameters: this.#state.parameters };
      // What was typed stays where the mistake is its own.
      if (!this.controls.has(error.parameter)) this.controls.parameters = this.#state.parameters;
      this.#complain(error);
      this.#record({}, false);
    }
    this.#progress(null);
    await this.#simulate(isStep);
  }

  #showLandscape({ values, warnings }) {
    const isPublished = Object.keys(this.#state.parameters).length === 0;
    this.#values = values;
    this.controls.clear();
    const { best, former, lines } = panels.changesOf(this.#atlas.fitness, values.fitness);
    const shown = [...(isPublished ? [] : lines), ...warnings.map((words) => `Note: ${words}`)];
    find("changes").replaceChildren(...shown.map((text) => element("p", { text })));
    this.map.show({ best: isPublished ? null : { from: former, to: best } });
    this.#paint();
  }

  #progress(done, total) {
    const row = find("progress-row");
    row.hidden = done === null;
    if (done === null) return;
    find("progress").value = done / total;
    find("progress-text").textContent = `${done} of ${total} designs`;
  }

  #paint() {
    const made = colouring(this.#state.map, this.#atlas, this.#values);
    this.map.paint(made);
    drawScale(find("scale"), made.scale);
    for (const id of ["low", "high", "unit"]) find(id).textContent = made[id];
  }

  // To keep and to share

  #saveCsv() {
    const table = new Blob([csvOf(this.#atlas, this.#values)], { type: "text/csv" });
    save(table, `${nameOf("landscape", this.#state.parameters)}.csv`);
  }

  async #savePng() {
    const { map, parameters } = this.#state;
    const words = ["low", "unit", "high"].map((id) => find(id).textContent);
    const physics = `physics: ${wordsOf(parameters) || "as published"}`;
    const picture = await pictureOf(find("map"), find("scale"), words, physics);
    save(picture, `${nameOf(`landscape-${map}`, parameters)}.png`);
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
