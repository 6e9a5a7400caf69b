// The colour of every design on each kind of map, and the scale that explains it.

import { cividis, puOr, sample, twilight } from "./palettes.js";

const NOTHING = [128, 128, 128]; // diverged
const STILL = [200, 200, 200]; // travels too little to have a heading
const SOME_TRAVEL = 0.25; // voxel widths, from which on a heading has its full colour

/** The heading of a displacement, degrees from +x towards +y. */
export function heading(dx, dy) {
  return (Math.atan2(dy, dx) * 180) / Math.PI;
}

/**
 * Return how to colour a map: {colour(design) -> [r, g, b], scale(share) -> [r, g, b], low, high,
 * unit}.
 */
export function colouring(kind, atlas, values) {
  if (kind === "heading") return headings(values);
  if (kind === "difference") return differences(atlas, values);
  const shown = kind === "noise" ? atlas.noise : values.fitness;
  const high = Math.max(1e-9, ...shown.filter((value) => value !== null));
  const unit =
    kind === "noise"
      ? `mean fitness under noise of level ${atlas.noise_level}, published physics`
      : "fitness, voxel widths";
  return {
    colour: (i) => (shown[i] === null ? NOTHING : sample(cividis, shown[i] / high)),
    scale: (share) => sample(cividis, share),
    low: "0",
    high: high.toFixed(2),
    unit,
  };
}

function headings({ dx, dy, fitness }) {
  const scale = (share) => sample(twilight, share);
  return {
    colour: (i) => {
      if (fitness[i] === null) return NOTHING;
      const strength = Math.min(1, fitness[i] / SOME_TRAVEL);
      const full = scale((heading(dx[i], dy[i]) + 180) / 360);
      return full.map((c, k) => STILL[k] + strength * (c - STILL[k]));
    },
    scale,
    low: "−180°",
    high: "180°",
    unit: "heading, 0° is +x; grey: hardly travels",
  };
}

function differences(atlas, { fitness }) {
  const change = fitness.map((value, i) => (value === null ? null : value - atlas.fitness[i]));
  const most = Math.max(...change.map((value) => Math.abs(value ?? 0)));
  const half = most || 1;
  return {
    colour: (i) => (change[i] === null ? NOTHING : sample(puOr, 0.5 + change[i] / (2 * half))),
    scale: (share) => sample(puOr, share),
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
