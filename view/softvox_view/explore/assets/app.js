// The page. `seen` is what is seen, and is kept in the address; `wanted` is what was asked for last,
// and is seen once it is computed.

import { pictureOf } from "./colours.js";
import { Controls } from "./controls.js";
import { Legend, NO_SCALE, scaleChecks } from "./legend.js";
import { landscapeMap } from "./map.js";
import { element, find, latest, save, sayTouch, unpacked } from "./page.js";
import { changesOf, csvOf, fillFacts, inShort, ranking, TOP, wordsOf } from "./panels.js";
import { NO_PATH, Paths } from "./paths.js";
import { physicsWritten, Refused } from "./physics.js";
import { designOf, digitsOf, drawRobot, editor, pictureOfRobots } from "./robot.js";
import { Simulator } from "./simulator.js";
import { MapWindow } from "./zoom.js";

const KINDS = [...find("kind").options].map((option) => option.value);
const DEFAULTS = { design: "6453", compare: "", map: "fitness", ...NO_SCALE, ...NO_PATH };
const PATH = Object.keys(NO_PATH); // which searcher's path is shown
const KEPT = 16; // landscapes

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const pathOf = (state) => Object.fromEntries(PATH.map((name) => [name, state[name]]));

const given = JSON.parse(find("data").textContent);
const { known, version, results } = given;
if (!globalThis.DecompressionStream) say("This page needs a newer browser, of 2023 or later.");
const packedTables = Object.entries(given.tables).map(async ([name, text]) => {
  const type = { cells: Uint16Array, is_connected: Uint8Array }[name] ?? Float64Array;
  return [name, [...new type(await unpacked(text))]];
});
const tables = Object.fromEntries(await Promise.all(packedTables));
const atlas = { ...tables, side: Math.sqrt(tables.cells.length), ...valuesOf(tables.dx, tables.dy) };
const simulator = new Simulator(known, await unpacked(given.engine));
globalThis.softvox = {
  simulate: (designs, physics, options) => simulator.simulate(designs, physics, options),
  landscape: (physics, options) => simulator.landscape(physics, options),
};

/** What the map shows of displacements, by design: null where one diverged, undefined not yet. */
function valuesOf(dx, dy) {
  const fitness = dx.map((x, i) => Math.sqrt(x * x + dy[i] * dy[i]));
  return Object.fromEntries(
    Object.entries({ dx, dy, fitness }).map(([name, row]) => [name, row.map((v) => (v === v ? v : null))]),
  );
}

let seen = { ...DEFAULTS, parameters: {} };
let wanted = seen;
let values = atlas; // the landscape now: {dx, dy, fitness}, by design
let player = null;
let shown = null; // the recording that it plays
let drafted = null; // values of a landscape under way
let ending = new AbortController(); // of that
const kept = new Map(); // landscapes by their parameters, so that going back costs nothing
const controls = new Controls(find("sliders"), known, (parameters) => want({ parameters }));
const showDrawing = editor(find("editor"), choose);
const zoomed = new MapWindow(atlas.side);
const pointAt = (design) => {
  drawRobot(find("hover-robot"), digitsOf(design));
  find("hover-text").textContent = inShort(design, atlas, drafted ?? values);
};
const map = landscapeMap(find("map"), atlas, choose, pointAt, zoomed);
const legend = new Legend((changes) => {
  record(changes, true);
  paint();
});
const paths = new Paths(results, atlas.fitness, map.show, (fields) => record(fields, true));

// The address: only what differs from the defaults

/** Return the state that the address tells: texts by name; whatever else it has are parameters. */
function read() {
  const state = { ...DEFAULTS, parameters: {} };
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    (Object.hasOwn(DEFAULTS, name) ? state : state.parameters)[name] = value;
  }
  if (state.map === "rank") Object.assign(state, { map: "fitness", by: "rank" }); // of older addresses
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
  const checks = { map: kindOf, design: designOf, compare: (text) => text && designOf(text), ...scaleChecks };
  say("");
  for (const [name, check] of Object.entries(checks)) {
    try {
      asked[name] = check(asked[name]);
    } catch (error) {
      complain(error);
      asked[name] = seen[name];
    }
  }
  const scale = Object.fromEntries(Object.keys(NO_SCALE).map((name) => [name, asked[name]]));
  seen = { ...seen, map: asked.map, ...scale, ...pathOf(asked) };
  find("kind").value = seen.map;
  controls.parameters = asked.parameters;
  paint();
  paths.show(pathOf(asked), false);
  want({ design: asked.design, compare: asked.compare, parameters: asked.parameters }, false);
}

function kindOf(text) {
  if (KINDS.includes(text)) return text;
  throw new Refused(`there is no map ${text}; the maps are ${KINDS.join(", ")}`);
}

function say(text, isGood = false) {
  find("message").textContent = text;
  find("message").classList.toggle("good", isGood);
}

/** Say what is wrong; return whether it was said beside a parameter. */
function complain(error) {
  const isBeside = controls.complain(error.parameter, error.message);
  if (!isBeside) say(error.message);
  if (!(error instanceof Refused)) reportError(error);
  return isBeside;
}

// The landscape and the robots

/** Compute the landscape where its parameters change, then the robots on it. */
async function want(changes, isStep = true) {
  wanted = { ...wanted, ...changes };
  if (changes.parameters) await recompute(changes.parameters, isStep);
  const { design, compare } = wanted;
  try {
    const designs = [design, compare].filter(Boolean).map(Number);
    const physics = physicsWritten(known, seen.parameters);
    const recording = await latest("recording", simulator.recording(designs, physics));
    record({ design, compare }, isStep);
    showRobots(recording);
  } catch (error) {
    wanted = { ...seen, parameters: wanted.parameters };
    complain(error);
  }
}

async function recompute(parameters, isStep) {
  ending.abort();
  drafted = null;
  if (same(parameters, seen.parameters)) {
    paint();
  } else {
    try {
      const notes = [];
      const made = await latest("landscape", compute(parameters, notes));
      record({ parameters }, isStep);
      showLandscape(made, notes);
    } catch (error) {
      // What was typed stays where the mistake is its own.
      if (!complain(error)) controls.parameters = seen.parameters;
      wanted = { ...wanted, parameters: seen.parameters };
      record({}, false);
      drafted = null;
      paint();
    }
  }
  find("progress-row").hidden = true;
  document.body.classList.remove("computing");
}

/** Compute a landscape, its cells filling in as they come. */
async function compute(parameters, notes) {
  const physics = physicsWritten(known, parameters, notes);
  if (same(parameters, {})) return atlas;
  const key = JSON.stringify(physics);
  if (!kept.has(key)) {
    ending = new AbortController();
    const { signal } = ending;
    const [dx, dy] = [[], []].map(() => new Array(atlas.cells.length).fill(undefined));
    let done = 0;
    let isDrawn = true;
    const onBlock = (designs, moved) => {
      designs.forEach((design, i) => ([dx[design], dy[design]] = moved.subarray(3 * i, 3 * i + 2)));
      done += designs.length;
      if (!isDrawn) return;
      isDrawn = false;
      requestAnimationFrame(() => {
        isDrawn = true;
        if (signal.aborted || done === dx.length) return;
        showProgress(done, dx.length);
        drafted = draftOf(dx, dy);
        paint();
      });
    };
    showProgress(0, dx.length);
    await simulator.landscape(physics, { onBlock, signal });
    if (kept.size >= KEPT) kept.delete(kept.keys().next().value);
    kept.set(key, valuesOf(dx, dy));
  }
  return kept.get(key);
}

function draftOf(dx, dy) {
  const made = valuesOf(dx.map((x) => x ?? 0), dy.map((y) => y ?? 0));
  for (const row of Object.values(made)) dx.forEach((x, i) => x === undefined && (row[i] = undefined));
  return made;
}

function showProgress(done, total) {
  find("progress-row").hidden = false;
  document.body.classList.add("computing");
  find("progress").value = done / total;
  find("progress-text").textContent = `${done} of ${total} designs`;
}

function showLandscape(made, warnings) {
  values = made;
  drafted = null;
  const isPublished = same(seen.parameters, {});
  const { best, former, lines } = changesOf(atlas.fitness, values.fitness);
  const told = [...(isPublished ? [] : lines), ...warnings.map((words) => `Note: ${words}`)];
  find("changes").replaceChildren(...told.map((text) => element("p", { text })));
  map.show({ best: isPublished ? null : { from: former, to: best } });
  paint();
}

function paint() {
  const now = drafted ?? values;
  const made = legend.show(seen, atlas, now, Boolean(drafted));
  const top = seen.outline && !drafted ? ranking(now.fitness).slice(0, TOP) : [];
  map.paint({ ...made, top, arrows: seen.map === "heading" && now });
}

function showRobots(recording) {
  const { design, compare, parameters } = seen;
  const designs = [design, compare].filter(Boolean);
  map.show({ marks: { A: design, B: compare } });
  showEdited();
  find("end-compare").hidden = !compare;
  fillFacts(find("facts"), designs, atlas, values);
  const isFirst = !player;
  player ??= new SoftvoxPlayer(find("player"));
  shown = recording;
  player.load(recording, pictureOfRobots(designs));
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
  say("");
  try {
    want({ [which()]: designOf(text) });
  } catch (error) {
    complain(error);
  }
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
  "zoom click": ({ target: { dataset } }) => dataset.factor && zoomed.zoom(Number(dataset.factor)),
  "reset click"() {
    controls.parameters = {};
    want({ parameters: {} });
  },
  "save-csv click": () => save(csvOf(atlas, values), `${nameOf("landscape")}.csv`),
  async "save-png click"() {
    const words = Object.fromEntries(["low", "unit", "high"].map((id) => [id, find(id).textContent]));
    const picture = await pictureOf(map.picture(), find("scale"), words, wordsOf(seen.parameters));
    save(picture, `${nameOf(`landscape-${seen.map}`)}.png`);
  },
  async "save-replay click"() {
    const name = ["replay", seen.design, seen.compare].filter(Boolean).join("-");
    const parts = {
      title: shown.robots.map(({ label }) => label).join("; "),
      rows: shown.robots.length > 1 ? "Row by row: " : "",
      still: pictureOfRobots(shown.robots.map(({ design }) => design)),
      recording: JSON.stringify(shown).replaceAll("<", "\\u003c"),
    };
    const template = new TextDecoder().decode(await unpacked(given.replay));
    const text = template.replace(/\{\{(\w+)\}\}/g, (_, part) => parts[part]);
    save(new Blob([text], { type: "text/html" }), `${nameOf(name)}.html`);
  },
  async "share click"() {
    const said = await navigator.clipboard.writeText(location.href).then(
      () => "The link is copied.",
      () => "The link is this page's address.",
    );
    say(said, true);
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

sayTouch();
find("version").textContent = `softvox-gym ${version}.`;
// On a narrow screen the robot itself comes first.
find("drawing").open = matchMedia("(min-width: 721px)").matches;
show();
