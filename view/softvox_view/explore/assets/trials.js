// Trials of robots: the designs with trials, on the map, and their tracks beside the simulated ones.

import { between, heading } from "./colours.js";
import { element, find } from "./page.js";
import { Refused } from "./physics.js";
import { unbase64 } from "./recording.js";
import { PIN } from "./sheet.js";

/**
 * In the address: the condition of the trials shown, "" for the first and NONE for no trials; and
 * whether whole runs are compared, with any number of cycles.
 */
export const NO_TRIALS = { trials: "", whole: "" };

const NONE = "none";
const TRIED_COLOURS = { measured: "#ff8a1f", simulated: "#45a3ff" }; // as in app.css, visible on any map
const NAMED = 9; // most designs named in a refusal
const AROUND = 0.5; // voxel widths around the tracks
const PIXELS = [440, 240]; // approximate size of the drawing

export class Trials {
  #given;

  /** Trials by condition; other choices go to onChoose(changes of the address). */
  constructor(given, onChoose) {
    this.#given = given;
    const names = Object.keys(given);
    find("trials-row").hidden = find("tried-row").hidden = !names.length;
    find("tried-in").append(...names.map((name) => new Option(name, name)), new Option(NONE, NONE));
    find("tried-in").addEventListener("change", ({ target: { value } }) => {
      onChoose({ trials: value === names[0] ? "" : value });
    });
    find("whole").addEventListener("change", ({ target: { checked } }) => onChoose({ whole: checked ? "yes" : "" }));
  }

  /** Return the condition in the address, or throw if it is invalid. */
  check(name) {
    const names = Object.keys(this.#given);
    if (!name || name === NONE || Object.hasOwn(this.#given, name)) return name;
    const there = names.length ? `there are ${names.join("; ")}` : "softvox explore --trials DIR adds some";
    throw new Refused(`there are no trials ${name}; ${there}`);
  }

  /** The trials of the condition in the address, {name, source, designs}, or nothing. */
  chosen(name) {
    const key = name || Object.keys(this.#given)[0];
    return this.#given[key] && { name: key, ...this.#given[key] };
  }

  /** Return the runs of a design, [{points}]; throw if it has none. */
  runsOf(design, name) {
    const chosen = this.chosen(this.check(name));
    if (!chosen) throw new Refused("no trials are shown, so there is no data on them");
    const { source, designs } = chosen;
    if (designs[design]) return designs[design];
    const tried = Object.keys(designs);
    const more = tried.length > NAMED ? ` and ${tried.length - NAMED} more` : "";
    throw new Refused(
      `Nobody ${source} design ${design} in “${chosen.name}”, so there is no data on it there; ` +
      `${source} were ${tried.slice(0, NAMED).join(", ")}${more}.`,
    );
  }

  /** The designs with trials, for the map, and their colour. */
  marked(name) {
    const { designs = {}, source } = this.chosen(name) ?? {};
    return { designs: Object.keys(designs).map(Number), colour: TRIED_COLOURS[source] };
  }

  /** Show designs, each with its simulated tracks: [{design, simulated: [{name, points}]}]. */
  show({ trials: name, whole }, robots) {
    const chosen = this.chosen(name);
    find("tried-in").value = chosen?.name ?? NONE;
    find("whole").checked = Boolean(whole);
    find("trials-key").hidden = !chosen;
    find("trials-views").replaceChildren();
    if (!chosen) return;
    const [tried, runs] = [Object.keys(chosen.designs).length, Object.values(chosen.designs).flat().length];
    const key = ` ${counted(tried, "design")}, ${counted(runs, "trial")}, ${chosen.name}`;
    find("trials-key").replaceChildren(pin(chosen.source), key);
    find("trials-views").replaceChildren(...robots.map((robot) => {
      try {
        return viewOf(robot, this.runsOf(robot.design, name), chosen.source, whole);
      } catch (error) {
        if (!(error instanceof Refused)) throw error;
        return element("p", { text: error.message });
      }
    }));
  }
}

/** The mark on the map, as a picture. */
function pin(source) {
  const shape = { points: PIN.join(" "), fill: TRIED_COLOURS[source], stroke: "#000", "stroke-width": 0.25 };
  const size = { width: 12, height: 14, viewBox: "-1.4 -2.8 2.8 3.2", "aria-hidden": "true" };
  return element("svg:svg", size, element("svg:polygon", shape));
}

/** The track of a robot in a recording, [[cycle, x, y]] in voxel widths; its end is replaced by moved. */
export function trackOf({ centre, last }, { seconds_per_frame, settle_time, frequency_hz, physics }, moved) {
  if (!Number.isFinite(moved[0])) return null;
  const values = new Float32Array(unbase64(centre).buffer);
  const rows = Array.from({ length: last + 1 }, (_, frame) => {
    const cycle = (frame * seconds_per_frame - settle_time) * frequency_hz;
    return [cycle, values[3 * frame], values[3 * frame + 1]];
  });
  const [, x, y] = at(rows, 0);
  const end = (physics.duration - settle_time) * frequency_hz;
  const moving = rows.filter(([cycle]) => cycle > 0 && cycle < end).map(([cycle, u, v]) => [cycle, u - x, v - y]);
  return [[0, 0, 0], ...moving, [end, moved[0], moved[1]]];
}

/** The position on a track after some cycles, interpolated linearly. */
export function at(points, cycle) {
  const next = points.findIndex(([own]) => own >= cycle);
  if (next < 0) return points.at(-1);
  if (!next) return points[0];
  const [a, b] = [points[next - 1], points[next]];
  const share = (cycle - a[0]) / (b[0] - a[0]);
  return a.map((value, k) => value + share * (b[k] - value));
}

/**
 * Compare tracks with the runs of a design, after as many cycles as all of them have, or each at its
 * end. Returns columns {name, kind, cycles, end, distance, heading, turn, apart}, the trials' mean
 * last; missing values are null.
 */
export function compared(simulated, runs, source, isWhole) {
  const all = [...simulated.filter(({ points }) => points), ...runs];
  const cycles = isWhole ? Infinity : Math.min(...all.map(({ points }) => points.at(-1)[0]));
  const column = (name, kind, points) => {
    const [own, ...end] = at(points, cycles);
    return { name, kind, cycles: own, end, distance: Math.hypot(...end), heading: heading(...end) };
  };
  const ends = runs.map(({ points }) => at(points, cycles));
  const mean = [0, 1, 2].map((k) => ends.reduce((sum, end) => sum + end[k], 0) / ends.length);
  const tried = column("trials", source, [mean]);
  const columns = simulated.map(({ name, points }) => {
    if (!points) return { name, kind: "here", cycles: null, distance: null, heading: null, turn: null, apart: null };
    const made = column(name, "here", points);
    made.turn = between(made.heading, tried.heading);
    made.apart = Math.hypot(made.end[0] - mean[1], made.end[1] - mean[2]);
    return made;
  });
  return [...columns, tried];
}

function viewOf({ design, simulated }, runs, source, isWhole) {
  const columns = compared(simulated, runs, source, isWhole);
  const count = `${runs.length > 1 ? "the mean of " : ""}${counted(runs.length, "trial")}`;
  const words = `Design ${design} from above, with ${count}, ${source}`;
  const caption = element("figcaption", { text: `${words}. Circles: where they are compared; lengths in voxel widths.` });
  return element("figure", {}, drawing(words, simulated, runs, columns), caption, tableOf(columns));
}

function tableOf(columns) {
  const rows = [
    ["after cycles", "cycles"], ["distance", "distance", 2], ["heading, °", "heading", 1],
    ["heading error, °", "turn", 1], ["ends apart", "apart", 2],
  ];
  const told = (value, decimals) => {
    if (value === undefined) return "";
    if (value === null) return "none";
    return (decimals ? value.toFixed(decimals) : String(Number(value.toFixed(2)))).replace("-", "−");
  };
  const body = rows.map(([text, key, decimals]) => {
    const cells = columns.map((column) => element("td", { text: told(column[key], decimals) }));
    return element("tr", {}, element("th", { text, scope: "row" }), ...cells);
  });
  const heads = columns.map(({ name, kind }) => element("th", { text: name, scope: "col", class: kind }));
  return element("table", { class: "numbers" }, element("tr", {}, element("td"), ...heads), ...body);
}

/** Tracks from above, x to the right and y upward. */
function drawing(words, simulated, runs, columns) {
  const there = simulated.filter(({ points }) => points);
  const all = [...there, ...runs].flatMap(({ points }) => points);
  const [left, right, down, up] = [1, 2].flatMap((k) => {
    const values = all.map((point) => point[k]);
    return [Math.min(...values) - AROUND, Math.max(...values) + AROUND];
  });
  const [width, height] = [right - left, up - down];
  const pixel = Math.max(width / PIXELS[0], height / PIXELS[1]);
  const line = (points, more) => {
    const d = `M${points.map(([, x, y]) => `${x.toFixed(3)} ${(-y).toFixed(3)}`).join("L")}`;
    return element("svg:path", { d, fill: "none", "stroke-width": 2 * pixel, "stroke-linejoin": "round", ...more });
  };
  const dot = ([x, y], more) => element("svg:circle", { cx: x, cy: -y, r: 4.5 * pixel, "stroke-width": 1.5 * pixel, ...more });
  const [x1, y1] = [left, -down - 2 * pixel];
  const bar = { x1, x2: x1 + 1, y1, y2: y1, stroke: "currentColor", "stroke-width": 3 * pixel };
  const text = { x: x1 + 1 + 5 * pixel, y: y1, "font-size": 12 * pixel, text: "1 voxel width" };
  return element("svg:svg", { viewBox: [left, -up, width, height].join(" "), role: "img", "aria-label": words },
    ...runs.map(({ points }) => line(points, { class: columns.at(-1).kind })),
    ...there.map(({ points }, k) => line(points, { class: "here", "stroke-dasharray": k ? 5 * pixel : "none" })),
    ...columns.filter(({ end }) => end).map(({ end, kind }) => dot(end, { class: kind })),
    dot([0, 0], { class: "start" }),
    element("svg:line", bar), element("svg:text", text),
  );
}

const counted = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
