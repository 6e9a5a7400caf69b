// The colour of every design on each kind of map, and the scale that explains it.

const LIGHT = "#fff";
const DARK = "#1a1f29";
const LITTLE = 0.25; // voxel widths: a design that travels less has no heading, as in softvox_gym.real_tracks
const UNKNOWN = [226, 230, 235]; // still being simulated
const DIMMED = 0.86; // headings are darker than the white of designs without one

/** The heading of a displacement, degrees from +x towards +y; null if it has none. */
export function heading(dx, dy) {
  return Math.hypot(dx, dy) >= LITTLE ? (Math.atan2(dy, dx) * 180) / Math.PI : null;
}

/** The angle between two headings, degrees from 0 to 180; null if either is null. */
export function between(first, second) {
  return first === null || second === null ? null : Math.abs(((second - first + 540) % 360) - 180);
}

/**
 * Return how to colour a map: {colour(design) -> [r, g, b], or null if it diverged,
 * scale(share) -> [r, g, b], grid: the colour of its lines, low, high, unit, shown: values by
 * design, range: [low, high] of the scale}. Colours go by "value" or "rank"; a given top is the end
 * of the scale.
 */
export function colouring(kind, atlas, values, { by = "value", top } = {}) {
  const noise = "mean fitness under noise of level 1, published physics";
  if (kind === "noise") return amounts(atlas.noise, noise, by, top);
  const made = {
    fitness: () => amounts(values.fitness, "fitness, voxel widths", by, top),
    heading: () => headings(values),
    difference: () => differences(values.fitness, atlas.fitness, top),
  }[kind]();
  if (values.fitness.includes(null)) made.unit += "; ×: diverged";
  const { colour } = made;
  return { ...made, colour: (i) => (values.fitness[i] === undefined ? UNKNOWN : colour(i)) };
}

function amounts(shown, unit, by, top) {
  const high = top ?? Math.max(1e-9, ...shown.filter(Boolean));
  const isRanked = by === "rank";
  const share = isRanked ? quantileOf(shown) : (value) => value / high;
  const colourOf = (value) => sample(cividis, share(value));
  const colour = (i) => (shown[i] === null ? null : colourOf(shown[i]));
  const scale = (at) => colourOf(at * high);
  const words = isRanked ? `${unit}; equally many designs per colour` : unit;
  return { colour, scale, grid: LIGHT, low: "0", high: high.toFixed(2), unit: words, shown, range: [0, high] };
}

/** Return the share of the known values below a value, so that outliers don't take all the colours. */
function quantileOf(shown) {
  const sorted = Float64Array.from(shown.filter((value) => (value ?? null) !== null)).sort();
  return (value) => {
    let [low, high] = [0, sorted.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sorted[middle] < value) low = middle + 1;
      else high = middle;
    }
    return low / Math.max(1, sorted.length - 1);
  };
}

function headings({ dx, dy, fitness }) {
  // As in the figure of headings: dark towards −x, light towards +x.
  const scale = (share) => sample(twilight, (share + 0.5) % 1).map((c) => DIMMED * c);
  const angles = fitness.map((_, i) => heading(dx[i], dy[i]));
  const colour = (i) => {
    if (fitness[i] === null) return null;
    return angles[i] === null ? [255, 255, 255] : scale((angles[i] + 180) / 360);
  };
  const unit = "heading, 0° is +x; white: hardly travels";
  const explained = { low: "−180°", high: "180°", unit, shown: angles, range: [-180, 180] };
  return { colour, scale, grid: DARK, ...explained };
}

function differences(now, before, top) {
  const shown = now.map((value, i) => (value === null ? null : value - before[i]));
  const most = top ?? Math.max(...shown.map((value) => Math.abs(value || 0)));
  const scale = (share) => sample(puOr, share);
  const colour = (i) => (now[i] === null ? null : scale(0.5 + shown[i] / (2 * (most || 1))));
  const [low, high, unit] = most
    ? [`−${most.toFixed(2)}`, `+${most.toFixed(2)}`, "fitness now minus published, voxel widths"]
    : ["", "", "no difference: this is the published physics"];
  return { colour, scale, grid: DARK, low, high, unit, shown, range: [-most, most] };
}

/** The colour of an evaluation of a path, early ones light: a share from 0 to 1. */
export function evaluationColour(share) {
  return `rgb(${sample(rdPu, share).map(Math.round).join(" ")})`;
}

/** Draw a scale into its canvas. */
export function drawScale(canvas, scale) {
  const pen = canvas.getContext("2d");
  for (let x = 0; x < canvas.width; x++) {
    pen.fillStyle = `rgb(${scale((x + 0.5) / canvas.width).map(Math.round).join(" ")})`;
    pen.fillRect(x, 0, 1, canvas.height);
  }
}

/** A picture of the map as a PNG, with its scale, {low, unit, high}, and a line about the physics below. */
export function pictureOf(map, scale, { low, unit, high }, physics) {
  const margin = 16;
  const [bar, line] = [14, 20];
  const below = map.height + 2 * margin;
  const width = map.width + 2 * margin;
  const all = new OffscreenCanvas(width, below + bar + 2 * line + margin);
  const pen = all.getContext("2d");
  const write = (text, x, y, align) => {
    pen.textAlign = align;
    pen.fillText(text, x, y, map.width);
  };
  pen.fillStyle = LIGHT;
  pen.fillRect(0, 0, all.width, all.height);
  pen.drawImage(map, margin, margin);
  pen.drawImage(scale, margin, below, map.width, bar);
  pen.fillStyle = DARK;
  pen.font = "15px system-ui, sans-serif";
  write(low, margin, below + bar + line - 2, "left");
  write(unit, width / 2, below + bar + line - 2, "center");
  write(high, width - margin, below + bar + line - 2, "right");
  write(physics, width / 2, below + bar + 2 * line, "center");
  return all.convertToBlob();
}

// Colour maps as evenly spaced anchors: cividis (Nunez et al., 2018) is perceptually uniform and
// colour-blind safe, twilight is cyclic, PuOr (ColorBrewer, Apache 2.0) has neither red nor green,
// and RdPu (also ColorBrewer) is on none of the maps.

const cividis = anchors(`
  00224e 00285b 002e6a 053371 1a386f 273e6e 32436d 3b496c 434e6c 4b546c 535a6d 5a5f6e
  61656f 686a71 6f7073 767676 7d7c78 848279 8c8878 938e78 9b9476 a39a74 aba072 b4a76f
  bcae6c c4b468 cdbb63 d5c25e dec958 e7d150 f0d846 f9e03a fee838`);

const twilight = anchors(`
  e2d9e2 d7d7dd c4ced4 acc2cc 95b5c7 81a6c3 7297c1 6887be 6276ba 5f64b5 5e51ad 5d3da1
  592a8f 511b77 45135c 381145 2f1436 3a113a 4a1342 5f174a 741e4f 872750 983550 a64550
  b25652 bb6958 c27c63 c89073 cca389 d1b6a3 d8c7be dfd4d6 e2d9e2`);

const puOr = anchors(`
  2d004b 390c5e 451871 522584 5f3a91 6d529c 7b6aa8 8a7eb3 9990bf a9a1cb b7b1d5 c3c0dd
  cfcfe5 dadcec e4e5f0 eeeef3 f7f7f6 f9efe1 fce8cd fee1b9 fed59f fdc885 fdbc6b f7ac52
  ee9b39 e58a20 d97b12 cb6e0d bd6109 ae5506 9e4c07 8d4307 7f3b08`);

const rdPu = anchors("fff7f3 fde0dd fcc5c0 fa9fb5 f768a1 dd3497 ae017e 7a0177 49006a");

function anchors(text) {
  const channels = (hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16));
  return text.trim().split(/\s+/).map(channels);
}

/** The colour [r, g, b] of a share from 0 to 1. */
function sample(palette, share) {
  const place = Math.min(Math.max(share, 0), 1) * (palette.length - 1);
  const i = Math.min(Math.floor(place), palette.length - 2);
  return palette[i].map((low, k) => low + (place - i) * (palette[i + 1][k] - low));
}
