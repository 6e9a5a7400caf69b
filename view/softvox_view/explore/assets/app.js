// The page. `seen` is what is seen, and is kept in the address; `wanted` is what was asked for last,
// and is seen once the server has answered.

import { SoftvoxPlayer } from "/player/player.js";
import { colouring, drawScale, pictureOf } from "./colours.js";
import { Controls } from "./controls.js";
import { landscapeMap } from "./map.js";
import { address, ask, cancel, element, find, Refused, save, saveBlob } from "./page.js";
import * as panels from "./panels.js";
import { designOf, digitsOf, drawRobot, editor } from "./robot.js";

const KINDS = [...find("kind").options].map((option) => option.value);
const NO_PATH = { results: "", searcher: "", seed: "1", budget: "100" };
const DEFAULTS = { design: "6453", compare: "", map: "fitness", ...NO_PATH };
const PATH = Object.keys(NO_PATH); // which searcher's path is shown

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const pathOf = (state) => Object.fromEntries(PATH.map((name) => [name, state[name]]));

const atlas = await ask("start").catch((error) => {
  find("message").textContent = error.message;
  throw error;
});
let seen = { ...DEFAULTS, parameters: {} };
let wanted = seen;
let values = atlas; // the landscape now: {dx, dy, fitness}, by design
let path = null; // of a searcher, with the fields that asked for it
let player = null;
const controls = new Controls(find("sliders"), atlas, (parameters) => want({ parameters }));
const showDrawing = editor(find("editor"), choose);
const map = landscapeMap(find("map"), atlas, choose, (design) => {
  drawRobot(find("hover-robot"), digitsOf(design));
  find("hover-text").textContent = panels.inShort(design, atlas, values);
});

// The address: only what differs from the defaults

/** Return the state that the address tells: texts by name; whatever else it has are parameters. */
function read() {
  const state = { ...DEFAULTS, parameters: {} };
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    (Object.hasOwn(DEFAULTS, name) ? state : state.parameters)[name] = value;
  }
  return state;
}

function written({ parameters, ...state }) {
  // All of a path is written, and nothing where there is none.
  const isWritten = (name) =>
    PATH.includes(name) ? state.searcher && state[name] : state[name] !== DEFAULTS[name];
  const changed = Object.entries(state).filter(([name]) => isWritten(name));
  return new URLSearchParams([...changed, ...Object.entries(parameters)]).toString();
}

/** Take on what is seen now; a step is one that the browser's Back undoes. */
function record(changes, isStep) {
  seen = { ...seen, ...changes };
  const isNew = written(seen) !== written(read());
  history[isNew && isStep ? "pushState" : "replaceState"](null, "", `#${written(seen)}`);
}

/** Show what the address tells, all of it; what can't be stays as it was. */
function show() {
  const asked = read();
  const checks = { map: kindOf, design: designOf, compare: (text) => text && designOf(text) };
  find("message").textContent = "";
  for (const [name, check] of Object.entries(checks)) {
    try {
      asked[name] = check(asked[name]);
    } catch (error) {
      complain(error);
      asked[name] = seen[name];
    }
  }
  seen = { ...seen, map: asked.map, ...pathOf(asked) };
  find("kind").value = seen.map;
  controls.parameters = asked.parameters;
  paint();
  showPath(pathOf(asked), false);
  want({ design: asked.design, compare: asked.compare, parameters: asked.parameters }, false);
}

function kindOf(text) {
  if (KINDS.includes(text)) return text;
  throw new Refused(`there is no map ${text}; the maps are ${KINDS.join(", ")}`);
}

/** Say what is wrong; return whether it was said beside a parameter. */
function complain(error) {
  const isBeside = controls.complain(error.parameter, error.message);
  if (!isBeside) find("message").textContent = error.message;
  if (!(error instanceof Refused)) reportError(error);
  return isBeside;
}

// The landscape and the robots

/** Compute the landscape where its parameters change, then the robots on it. */
async function want(changes, isStep = true) {
  wanted = { ...wanted, ...changes };
  if (changes.parameters) await recompute(changes.parameters, isStep);
  const { design, compare } = wanted;
  const query = queryOf(wanted);
  try {
    const recording = await ask("recording", query);
    record({ design, compare }, isStep);
    showRobots(recording, query);
  } catch (error) {
    wanted = { ...seen, parameters: wanted.parameters };
    complain(error);
  }
}

/** What tells which robots there are, on the landscape that is seen. */
function queryOf({ design, compare }) {
  return { design, ...(compare && { compare }), ...seen.parameters };
}

async function recompute(parameters, isStep) {
  cancel("landscape");
  if (!same(parameters, seen.parameters)) {
    showProgress(0, 6561);
    try {
      const answer = await ask("landscape", parameters, showProgress);
      record({ parameters }, isStep);
      showLandscape(answer);
    } catch (error) {
      // What was typed stays where the mistake is its own.
      if (!complain(error)) controls.parameters = seen.parameters;
      wanted = { ...wanted, parameters: seen.parameters };
      record({}, false);
    }
  }
  find("progress-row").hidden = true;
}

function showProgress(done, total) {
  find("progress-row").hidden = false;
  find("progress").value = done / total;
  find("progress-text").textContent = `${done} of ${total} designs`;
}

function showLandscape({ values: made, warnings }) {
  values = made;
  const isPublished = same(seen.parameters, {});
  const { best, former, lines } = panels.changesOf(atlas.fitness, values.fitness);
  const shown = [...(isPublished ? [] : lines), ...warnings.map((words) => `Note: ${words}`)];
  find("changes").replaceChildren(...shown.map((text) => element("p", { text })));
  map.show({ best: isPublished ? null : { from: former, to: best } });
  paint();
}

function paint() {
  const made = colouring(seen.map, atlas, values);
  map.paint(made);
  drawScale(find("scale"), made.scale);
  for (const id of ["low", "high", "unit"]) find(id).textContent = made[id];
}

function showRobots(recording, query) {
  const { design, compare, parameters } = seen;
  const designs = [design, compare].filter(Boolean);
  map.show({ marks: { A: design, B: compare } });
  showEdited();
  find("end-compare").hidden = !compare;
  panels.fillFacts(find("facts"), designs, atlas, values);
  const isFirst = !player;
  player ??= new SoftvoxPlayer(find("player"));
  player.load(recording, address("still.png", query));
  if (isFirst) player.autoplay();
  find("robot-panel").dataset.designs = designs.join(" ");
  document.body.dataset.parameters = JSON.stringify(parameters);
}

/** Which robot the next click changes, "design" or "compare". */
function which() {
  return document.querySelector("#which input:checked").value;
}

/** Show that robot where it can be drawn and named. */
function showEdited() {
  const design = seen[which()] || seen.design;
  showDrawing(digitsOf(design));
  find("find-text").value = design;
}

function choose(text) {
  find("message").textContent = "";
  try {
    want({ [which()]: designOf(text) });
  } catch (error) {
    complain(error);
  }
}

// A searcher's path

/**
 * Show the path that fields tell. Where the form asked for it, the address takes it on once it is
 * there, and what can't be had leaves all as it was.
 */
async function showPath(fields, isOfForm) {
  const bar = find("path-progress");
  offer(fields.results);
  for (const name of PATH) find(name).value = fields[name];
  cancel("path");
  try {
    if (fields.searcher && !same(fields, path?.fields)) {
      bar.removeAttribute("value");
      bar.hidden = false;
      find("path-text").textContent = "";
      const found = await ask("path", fields, (done, total) => (bar.value = done / total));
      path = { ...found, fields, best: panels.improvements(found) };
      find("upto").max = path.designs.length;
      find("upto").value = path.designs.length;
    } else if (!fields.searcher) {
      path = null;
    }
    drawPath();
    if (isOfForm) record(fields, true);
  } catch (error) {
    if (!isOfForm) path = null;
    drawPath();
    find("path-text").textContent = error.message;
  }
  bar.hidden = true;
}

/** Offer the searchers of some results, or those that can run live. */
function offer(results) {
  const names = (results ? atlas.results[results] : atlas.searchers) ?? [];
  find("searcher").replaceChildren(new Option("none", ""), ...names.map((s) => new Option(s, s)));
  find("search").textContent = results ? "Show" : "Search";
  find("path-source").textContent = results
    ? "Recorded; the budget is how many evaluations are shown."
    : "A live run, on the published landscape.";
}

function drawPath() {
  const upto = Number(find("upto").value);
  find("upto-row").hidden = !path;
  map.show({ path: path && { ...path, upto } });
  find("path-text").textContent = path ? panels.pathInShort(path, upto, atlas) : "";
}

// What is done on the page

/** A file's name that tells what differs from the published physics. */
function nameOf(what) {
  const changes = Object.entries(seen.parameters).map(([name, value]) => `_${name}_${value}`);
  return [what, ...changes].join("").replace(/[^\w.+-]/g, "");
}

const actions = {
  "find submit": () => choose(find("find-text").value.trim()),
  "which change": showEdited,
  "end-compare click"() {
    document.querySelector('#which input[value="design"]').checked = true;
    want({ compare: "" });
  },
  "kind change"() {
    record({ map: find("kind").value }, true);
    paint();
  },
  "reset click"() {
    controls.parameters = {};
    want({ parameters: {} });
  },
  "path submit": () => showPath(pathOf(Object.fromEntries(new FormData(find("path")))), true),
  "results change"({ target: { value } }) {
    offer(value);
    find("seed").value = value ? "0" : NO_PATH.seed;
  },
  "clear-path click": () => showPath(NO_PATH, true),
  "upto input": drawPath,
  "save-csv click": () => saveBlob(panels.csvOf(atlas, values), `${nameOf("landscape")}.csv`),
  async "save-png click"() {
    const words = ["low", "unit", "high"].map((id) => find(id).textContent);
    const physics = panels.wordsOf(seen.parameters);
    saveBlob(await pictureOf(find("map"), find("scale"), words, physics), `${nameOf(`landscape-${seen.map}`)}.png`);
  },
  "save-replay click"() {
    const name = ["replay", seen.design, seen.compare].filter(Boolean).join("-");
    save(address("replay.html", queryOf(seen)), `${nameOf(name)}.html`);
  },
  async "share click"() {
    find("message").textContent = await navigator.clipboard.writeText(location.href).then(
      () => "The link is copied.",
      () => "The link is this page's address.",
    );
  },
};
for (const [what, handler] of Object.entries(actions)) {
  const [id, type] = what.split(" ");
  find(id).addEventListener(type, (event) => {
    if (type === "submit") event.preventDefault();
    handler(event);
  });
}
addEventListener("hashchange", show);

const options = Object.keys(atlas.results).map((name) => new Option(name, name));
find("results").append(new Option("a live run", ""), ...options);
find("results-row").hidden = !options.length;
find("version").textContent = `softvox-gym ${atlas.version}.`;
// On a narrow screen the robot itself comes first.
find("drawing").open = matchMedia("(min-width: 721px)").matches;
show();
