// The page. `seen` is the requested state, which is kept in the address; what is shown stays dim until
// it matches.

import { keep } from "../../replay/assets/export.js";
import { SoftvoxPlayer } from "../../replay/assets/player.js";
import { pictureOf } from "./colours.js";
import { Controls } from "./controls.js";
import { countsOf, Finder, FILTERS, leadersOf, passing } from "./finder.js";
import { Legend, NO_SCALE, scaleChecks } from "./legend.js";
import { landscapeMap } from "./map.js";
import { element, fillable, find, latest, sayTouch, unpacked } from "./page.js";
import { changesOf, csvOf, fillFacts, inBrief, inShort, ranking, topOf, wordsOf } from "./panels.js";
import { NO_PATH, Paths } from "./paths.js";
import { physicsWritten, Refused } from "./physics.js";
import { together } from "./recording.js";
import { designOf, digitsOf, drawRobot, editor, pictureOfRobots } from "./robot.js";
import { Simulator } from "./simulator.js";
import { story } from "./story.js";
import { NO_TRIALS, trackOf, Trials } from "./trials.js";
import { kendall, scatter } from "./versus.js";
import { valuesOf, World } from "./world.js";
import { MapWindow } from "./zoom.js";

const KINDS = [...find("kind").options].map((option) => option.value);
const DEFAULTS = { design: "6453", compare: "", map: "fitness", ...NO_SCALE, ...FILTERS, ...NO_PATH, ...NO_TRIALS };
const PATH = Object.keys(NO_PATH); // the keys of the searcher's path that is shown
const SECOND = "b."; // prefix of the second world's parameters
const MAPS = ["map", "map-b"];
const FADED = 0.88; // how far designs that fail a filter fade into a light grey
const GREY = 228;

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const part = (names) => (state) => Object.fromEntries(names.map((name) => [name, state[name]]));
const pathOf = part(PATH);
const robotsOf = part(["design", "compare", "parameters", "versus"]);
const filtersOf = part(Object.keys(FILTERS));
const scaleOf = part(Object.keys(NO_SCALE));

const given = JSON.parse(find("data").textContent);
const { known, version, results } = given;
if (!globalThis.DecompressionStream) {
  find("message").textContent =
    "This browser can't unpack the page's data (no DecompressionStream); use one from 2023 or later.";
}
const packedTables = Object.entries(given.tables).map(async ([name, text]) => {
  const type = { cells: Uint16Array, classes: Uint16Array, is_connected: Uint8Array }[name] ?? Float64Array;
  return [name, [...new type(await unpacked(text))]];
});
const tables = Object.fromEntries(await Promise.all(packedTables));
const published = valuesOf(tables.dx, tables.dy);
const side = Math.sqrt(tables.cells.length);
const atlas = { ...tables, side, ...published, counts: countsOf([...tables.cells.keys()]) };
const engine = await unpacked(given.engine);
const simulator = new Simulator(known, engine);
find("lacking").hidden = globalThis.WebAssembly?.validate(engine) ?? false;
find("player").hidden = !find("lacking").hidden;
globalThis.softvox = {
  simulate: (designs, physics, options) => simulator.simulate(designs, physics, options),
  landscape: (physics, options) => simulator.landscape(physics, options),
  trials: async (design, name) => trials.runsOf(designOf(design), name),
};

let seen = { ...DEFAULTS, parameters: {}, versus: null }; // versus: the second world's, or null
let player = null;
let shown = null; // the robots: {state, recording, moved}
let pointed = null; // the design last under the pointer
let hushing = 0; // the timer that hides the message
let seenPasses = []; // by design, whether it passes the filters
const standard = { key: JSON.stringify(physicsWritten(known, {})), values: published };
const [here, there] = [0, 1].map(() => new World(simulator, standard, showLandscapes));
const controls = new Controls(find("sliders"), known, (parameters) => want({ parameters }));
const showDrawing = editor(find("editor"), choose);
const finder = new Finder((filters) => {
  record(filters, true);
  paint();
  showLeaders();
}, choose);
const zoomed = new MapWindow(atlas.side);
const maps = MAPS.map((id) => {
  find(id).addEventListener("pointerleave", () => pointAt(null, id));
  return landscapeMap(find(id), atlas, choose, (design) => pointAt(design, id), zoomed);
});
const legend = new Legend((changes) => {
  record(changes, true);
  paint();
});
const showOnMaps = (what) => maps.forEach((map) => map.show(what));
const paths = new Paths(results, atlas.fitness, showOnMaps, (fields) => record(fields, true));
const trials = new Trials(given.trials, (fields) => {
  record(fields, true);
  showTrials();
  paint();
  showLeaders();
});
const showScatter = scatter(find("scatter"), choose, (design) => pointAt(design, "scatter"));

// The address: it has only what differs from the defaults

/** Return the state in the address: texts by name; all unknown names are parameters. */
function read() {
  const state = { ...DEFAULTS, parameters: {}, versus: null };
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    if (name.startsWith(SECOND)) (state.versus ??= {})[name.slice(SECOND.length)] = value;
    else (Object.hasOwn(DEFAULTS, name) ? state : state.parameters)[name] = value;
  }
  return state;
}

function written({ parameters, versus, ...state }) {
  // A path is written with all its keys, or not at all.
  const isWritten = (name) =>
    PATH.includes(name) ? state.searcher && state[name] : state[name] !== DEFAULTS[name];
  const changed = Object.entries(state).filter(([name]) => isWritten(name));
  const second = Object.entries(versus ?? {}).map(([name, value]) => [SECOND + name, value]);
  return new URLSearchParams([...changed, ...Object.entries(parameters), ...second]).toString();
}

/** Take on a new state; a step can be undone by the browser's Back. */
function record(changes, isStep) {
  seen = { ...seen, ...changes };
  const isNew = written(seen) !== written(read());
  history[isNew && isStep ? "pushState" : "replaceState"](null, "", `#${written(seen)}`);
}

/** Show the state in the address; invalid parts of it leave the page as it was. */
function show() {
  const asked = read();
  const checks = { map: kindOf, design: designOf, compare: (text) => text && designOf(text), ...scaleChecks };
  checks.trials = (text) => trials.check(text);
  say("");
  for (const [name, check] of Object.entries(checks)) {
    try {
      asked[name] = check(asked[name]);
    } catch (error) {
      complain(error);
      asked[name] = seen[name];
    }
  }
  for (const name of finder.set(filtersOf(asked))) {
    complain(new Refused(`there is no filter ${name} ${asked[name]}`));
    asked[name] = FILTERS[name];
  }
  seen = { ...seen, map: asked.map, trials: asked.trials, whole: asked.whole, ...scaleOf(asked), ...filtersOf(asked), ...pathOf(asked) };
  find("kind").value = seen.map;
  controls.parameters = asked.parameters;
  paths.show(pathOf(asked), false);
  want(robotsOf(asked), false);
}

function kindOf(text) {
  if (KINDS.includes(text)) return text;
  throw new Refused(`there is no map ${text}; the maps are ${KINDS.join(", ")}`);
}

function say(text, isGood = false) {
  find("message").textContent = text;
  find("message").classList.toggle("good", isGood);
  clearTimeout(hushing);
  hushing = setTimeout(say, isGood ? 4000 : 15_000, "");
}

/** Report an error; return whether it was shown beside a parameter. */
function complain(error) {
  const isBeside = controls.complain(error.parameter, error.message);
  if (!isBeside) say(error.message);
  if (!(error instanceof Refused)) reportError(error);
  return isBeside;
}

// The landscapes and the robots

/** Show other robots or other worlds: the robots at once, the landscapes as they are computed. */
function want(changes, isStep = true) {
  const notes = [];
  for (const name of ["parameters", "versus"].filter((world) => changes[world])) {
    try {
      physicsWritten(known, changes[name], notes);
    } catch (error) {
      // What was typed stays if the mistake is in it.
      if (name === "versus") say(`The second world: ${error.message}`);
      else if (!complain(error)) controls.parameters = seen.parameters;
      delete changes[name];
    }
  }
  // While a slider moves, its values are no steps.
  record(changes, isStep && !(changes.parameters && !here.isWhole));
  find("notes").replaceChildren(...notes.map((words) => element("p", { text: `Note: ${words}` })));
  document.body.classList.toggle("two-worlds", Boolean(seen.versus));
  const [first, second] = worlds().map(({ parameters }) => physicsWritten(known, parameters));
  showRobots([first, second].filter(Boolean));
  if (!second) there.stop();
  else if ("versus" in changes) there.become(second).catch(complain);
  if (changes.parameters) here.become(first).catch(complain);
  if (changes.parameters || "versus" in changes) showLandscapes();
  else settle();
}

/** The worlds that are shown: their names, parameters and landscapes. */
function worlds() {
  const all = [{ parameters: seen.parameters, world: here }];
  if (seen.versus) all.push({ parameters: seen.versus, world: there });
  // Parameters that both worlds share distinguish nothing.
  const common = ([name, value]) => all.length > 1 && all.every(({ parameters }) => parameters[name] === value);
  return all.map((one) => {
    const own = Object.fromEntries(Object.entries(one.parameters).filter((change) => !common(change)));
    const { preset } = one.parameters;
    return { ...one, name: nameOfWorld(same(own, {}) ? { preset } : own) };
  });
}

function nameOfWorld({ preset, ...changes }) {
  const words = Object.entries(changes).map(([name, value]) => `${name} ${value}`.replaceAll("_", " "));
  return [...(preset || !words.length ? [preset ?? "published"] : []), ...words].join(", ").replaceAll("_", " ");
}

/** Dim what is out of date, and show the progress. */
function settle() {
  const [state, shows] = [seen, shown?.state].map((one) => one && robotsOf(one));
  const isTrue = same(state, shows);
  const isWhole = worlds().every(({ world }) => world.isWhole);
  document.body.classList.toggle("computing", !isTrue);
  document.body.classList.toggle("drafting", !isWhole);
  find("progress-row").hidden = isWhole;
  find("save-csv").disabled = !here.isWhole;
  const [done, all] = worlds().reduce(([a, b], { world }) => [a + world.done, b + world.values.fitness.length], [0, 0]);
  find("progress").value = done / all;
  find("progress-text").textContent = `${done} of ${all} designs`;
  if (isTrue && here.isWhole) document.body.dataset.parameters = JSON.stringify(seen.parameters);
  else delete document.body.dataset.parameters;
}

/** Show everything that depends on the landscapes, as far as they are known. */
function showLandscapes() {
  paint();
  if (shown) showFacts();
  let best = null;
  if (here.isWhole) {
    const changes = here.values === published ? null : changesOf(atlas.fitness, here.values.fitness);
    best = changes && { from: changes.former, to: changes.best };
    find("changes").replaceChildren(...(changes?.lines ?? []).map((text) => element("p", { text })));
    showLeaders();
  }
  maps[0].show({ best });
  showVersus();
  settle();
}

function paint() {
  const all = worlds();
  const isDraft = !all.every(({ world }) => world.isWhole);
  // One scale for both worlds: they are coloured as if they were one, with twice as many designs.
  const joined = (rows) => Object.fromEntries(
    ["dx", "dy", "fitness", "noise"].map((name) => [name, rows.flatMap((row) => row[name] ?? [])]),
  );
  const made = legend.show(seen, joined(all.map(() => atlas)), joined(all.map(({ world }) => world.values)), isDraft);
  seenPasses = passing(seen, { ...atlas, tried: trials.marked(seen.trials).designs }, here.values);
  all.forEach(({ world: { values }, name }, k) => {
    const first = k * atlas.fitness.length;
    maps[k].paint({
      ...made,
      colour: (design) => faded(made.colour(first + design), seenPasses[design]),
      arrows: seen.map === "heading" && values,
      top: seen.outline && !isDraft ? topOf(values.fitness) : [],
    });
    find(["name-a", "name-b"][k]).textContent = name;
  });
  if (pointed !== null) pointAt(pointed);
}

function faded(colour, passes) {
  return passes ? colour : (colour ?? [255, 255, 255]).map((c) => GREY + (1 - FADED) * (c - GREY));
}

/** Describe the design under the pointer in all worlds, and ring it where the pointer is not. */
function pointAt(design, from) {
  if (from && seen.versus) {
    const ringed = (id) => ({ marks: { ...marks(), "": from === id ? "" : String(design ?? "") } });
    MAPS.forEach((id, k) => maps[k].show(ringed(id)));
    showScatter({ point: design });
  }
  if (design === null) return;
  pointed = design;
  drawRobot(find("hover-robot"), digitsOf(design));
  const second = worlds().slice(1).map(({ name, world }) => `${name}: ${inBrief(design, world.values)}`);
  const runs = trials.chosen(seen.trials)?.designs[design]?.length;
  const tried = runs ? [`trials: ${runs}`] : [];
  find("hover-text").textContent = [inShort(design, atlas, here.values), ...second, ...tried].join("; ");
}

const marks = () => ({ A: seen.design, B: seen.compare });

function showLeaders() {
  const order = ranking(here.values.fitness);
  const all = leadersOf(order, seenPasses, seen.each && atlas.classes);
  finder.show(all, here.values.fitness, seenPasses.filter(Boolean).length);
}

/** Show how well the ranks of two worlds agree. */
function showVersus() {
  const only = Object.keys(seen.versus ?? {}).join() === "preset" ? seen.versus.preset : "";
  find("kept").hidden = !seen.versus || Boolean(only);
  find("versus").value = only || (seen.versus ? "kept" : "");
  if (!seen.versus) return;
  const [first, second] = worlds();
  find("scatter-title").textContent = `ranks: → ${first.name}, ↑ ${second.name}`;
  if (!here.isWhole || !there.isWhole) return;
  const fitness = [here, there].map(({ values }) => values.fitness.map((value) => value ?? 0));
  find("tau").textContent = `Kendall’s τ ${kendall(...fitness).toFixed(2).replace("-", "−")}`;
  showScatter({ fitness });
}

async function showRobots(physics) {
  const state = seen;
  const designs = [state.design, state.compare].filter(Boolean);
  const names = worlds().map(({ name }) => name);
  [...maps.map(({ show }) => show), showScatter].forEach((mark) => mark({ marks: marks() }));
  showEdited();
  find("end-compare").hidden = !state.compare;
  try {
    const wishes = physics.map((one) => simulator.recording(designs.map(Number), one));
    const made = await latest("recording", Promise.all(wishes));
    const recording = together(made.map((one) => one.recording), names);
    shown = { state, names, recording, made, moved: made.map(({ moved }) => moved) };
  } catch (error) {
    complain(error);
    return;
  }
  const isFirst = !player;
  player ??= new SoftvoxPlayer(find("player"));
  player.load(shown.recording, pictureOfRobots(shown.recording.robots.map(({ design }) => design)));
  if (isFirst) player.autoplay();
  find("robot-panel").dataset.designs = designs.join(" ");
  showFacts();
  showTrials();
  settle();
}

/** Fill the table with the robots that are shown. */
function showFacts() {
  const { state, names, moved } = shown;
  const columns = [["A", state.design], ["B", state.compare]].flatMap(([letter, design], i) =>
    worlds().slice(0, design && names.length).map(({ world }, k) => {
      const name = [(state.compare || !names[1]) && letter, names[1] && names[k]].filter(Boolean).join(", ");
      return { name, design, moved: moved[k].subarray(3 * i, 3 * i + 2), world };
    }),
  );
  fillFacts(find("facts"), columns, atlas);
}

/** Mark the designs with trials on the map, and compare the robots shown with their trials. */
function showTrials() {
  showOnMaps({ tried: trials.marked(seen.trials) });
  const { made = [], names = [], recording } = shown ?? {};
  const designs = recording ? made[0].recording.robots.map(({ design }) => design) : [];
  trials.show(seen, designs.map((design, i) => ({
    design,
    simulated: made.map(({ recording: own, moved }, k) => {
      return { name: names[k], points: trackOf(own.robots[i], own, moved.subarray(3 * i)) };
    }),
  })));
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

// Actions on the page

/** Go to an address. */
function go(address) {
  location.hash = address;
}

/** A file name with what differs from the published physics. */
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
  "versus change": ({ target: { value } }) => want({ versus: value ? { preset: value } : null }),
  "keep click": () => want({ versus: same(seen.parameters, {}) ? { preset: "published" } : seen.parameters }),
  "finding click": () => go("design=6453&b.preset=reversal"),
  "save-csv click": () => keep(csvOf(atlas, here.values), `${nameOf("landscape")}.csv`),
  async "save-png click"() {
    const words = Object.fromEntries(["low", "unit", "high"].map((id) => [id, find(id).textContent]));
    const pins = [trials.chosen(seen.trials)].filter(Boolean).map(({ name }) => `pins: ${name}`);
    const picture = await pictureOf(maps[0].picture(), find("scale"), words, [wordsOf(seen.parameters), ...pins].join("; "));
    keep(picture, `${nameOf(`landscape-${seen.map}`)}.png`);
  },
  async "save-replay click"() {
    const second = seen.versus && `versus-${nameOfWorld(seen.versus)}`;
    const name = ["replay", seen.design, seen.compare, second].filter(Boolean).join("-");
    const parts = {
      title: shown.recording.robots.map(({ label }) => label).join("; "),
      rows: shown.recording.robots.length > 1 ? "Row by row: " : "",
      still: pictureOfRobots(shown.recording.robots.map(({ design }) => design)),
      recording: JSON.stringify(shown.recording).replaceAll("<", "\\u003c"),
    };
    const template = new TextDecoder().decode(await unpacked(given.replay));
    const text = template.replace(/\{\{(\w+)\}\}/g, (_, part) => parts[part]);
    keep(new Blob([text], { type: "text/html" }), `${nameOf(name)}.html`);
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
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => showScatter({}));

sayTouch();
find("versus").append(...Object.keys(known.presets).map((name) => new Option(name.replaceAll("_", " "), name)));
find("version").textContent = `softvox-gym ${version}.`;
// On a narrow screen the moving robot comes first.
find("drawing").open = matchMedia("(min-width: 721px)").matches;
fillable([find("map-panel"), find("robot-panel")]);
const isEmpty = !location.hash.slice(1);
show();
story(isEmpty, go);
