// The colour of every design on each kind of map, and the scale that explains it.

import { cividis, puOr, sample, twilight } from "./palettes.js";

const LIGHT = "#fff";
const DARK = "#1a1f29";
const SOME_TRAVEL = 0.25; // voxel widths: what travels less has no heading to speak of
const DIMMED = 0.86; // headings are darker than the white of those that have none

/** The heading of a displacement, degrees from +x towards +y. */
export function heading(dx, dy) {
  return (Math.atan2(dy, dx) * 180) / Math.PI;
}

/**
 * Return how to colour a map: {colour(design) -> [r, g, b] or null where it diverged,
 * scale(share) -> [r, g, b], grid: the colour of its lines, low, high, unit}.
 */
export function colouring(kind, atlas, values) {
  const made = { heading: headings, difference: differences }[kind] ?? fitnesses;
  const has = values.fitness.includes(null) && kind !== "noise";
  const { unit, ...rest } = made(atlas, values, kind);
  return { ...rest, unit: has ? `${unit}; ×: diverged` : unit };
}

function fitnesses(atlas, values, kind) {
  const shown = kind === "noise" ? atlas.noise : values.fitness;
  const high = Math.max(1e-9, ...shown.filter((value) => value !== null));
  const unit =
    kind === "noise"
      ? `mean fitness under noise of level ${atlas.noise_level}, published physics`
      : "fitness, voxel widths";
  return {
    colour: (i) => (shown[i] === null ? null : sample(cividis, shown[i] / high)),
    scale: (share) => sample(cividis, share),
    grid: LIGHT,
    low: "0",
    high: high.toFixed(2),
    unit,
  };
}

function headings(_, { dx, dy, fitness }) {
  // As in the figure of headings: dark towards −x, light towards +x.
  const scale = (share) => sample(twilight, (share + 0.5) % 1).map((c) => DIMMED * c);
  return {
    colour: (i) => {
      if (fitness[i] === null) return null;
      if (fitness[i] < SOME_TRAVEL) return [255, 255, 255];
      return scale((heading(dx[i], dy[i]) + 180) / 360);
    },
    scale,
    grid: DARK,
    low: "−180°",
    high: "180°",
    unit: "heading, 0° is +x; white: hardly travels",
  };
}

function differences(atlas, { fitness }) {
  const change = fitness.map((value, i) => (value === null ? null : value - atlas.fitness[i]));
  const most = Math.max(...change.map((value) => Math.abs(value ?? 0)));
  const half = most || 1;
  return {
    colour: (i) => (change[i] === null ? null : sample(puOr, 0.5 + change[i] / (2 * half))),
    scale: (share) => sample(puOr, share),
    grid: DARK,
    low: most ? `−${most.toFixed(2)}` : "",
    high: most ? `+${most.toFixed(2)}` : "",
    unit: most ? "fitness now less published, voxel widths" : "no difference: the physics is as published",
  };
}

/** Draw a scale into its canvas. */
export function drawScale(canvas, scale) {
  const pen = canvas.getContext("2d");
  for (let x = 0; x < canvas.width; x++) {
    pen.fillStyle = `rgb(${scale((x + 0.5) / canvas.width).map(Math.round).join(" ")})`;
    pen.fillRect(x, 0, 1, canvas.height);
  }
}
