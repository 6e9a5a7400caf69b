// Two worlds compared: the agreement of their ranks, and a picture of it.

import { ranking, TOP } from "./panels.js";

const NEAR = 12; // canvas pixels: the greatest distance at which a click picks a point
const MARGIN = 8;

/** Kendall's tau-b of two arrays of numbers, after Knight (1966), in n log n steps. */
export function kendall(first, second) {
  const count = first.length;
  const places = [...first.keys()].sort((i, j) => first[i] - first[j] || second[i] - second[j]);
  const levels = new Map([...new Set(second)].sort((a, b) => a - b).map((value, k) => [value, k + 1]));
  const seen = new Int32Array(levels.size + 1); // a Fenwick tree: how many of each level came before
  let disagreeing = 0;
  places.forEach((place, before) => {
    const level = levels.get(second[place]);
    let upToIt = 0;
    for (let k = level; k > 0; k -= k & -k) upToIt += seen[k];
    for (let k = level; k < seen.length; k += k & -k) seen[k] += 1;
    disagreeing += before - upToIt;
  });
  const [pairs, a, b] = [(count * (count - 1)) / 2, tied(first), tied(second)];
  const both = tied(first.map((value, i) => `${value} ${second[i]}`));
  return (pairs - a - b + both - 2 * disagreeing) / Math.sqrt(pairs - a) / Math.sqrt(pairs - b);
}

/** The number of pairs of equal values. */
function tied(values) {
  const counts = new Map();
  for (const value of values) counts.set(value, (counts.get(value) ?? 0) + 1);
  return [...counts.values()].reduce((sum, n) => sum + (n * (n - 1)) / 2, 0);
}

/**
 * Make a scatter plot of ranks on a canvas, the best at the upper right; it calls onPick(design) and
 * onPoint(design or null). Returns show({fitness: two arrays, marks, point}); missing arguments keep
 * their last values.
 */
export function scatter(canvas, onPick, onPoint) {
  const pen = canvas.getContext("2d");
  const size = canvas.width;
  let points = []; // [x, y] by design
  let order = [];
  let shown = { marks: {}, point: null };

  function near({ clientX, clientY }) {
    const box = canvas.getBoundingClientRect();
    const scale = size / box.width;
    const [x, y] = [(clientX - box.left) * scale, (clientY - box.top) * scale];
    const far = points.map(([px, py]) => Math.hypot(px - x, py - y));
    const least = far.reduce((best, distance, i) => (distance < far[best] ? i : best), 0);
    return far[least] < NEAR * scale ? least : null;
  }

  function place(fitness) {
    const orders = fitness.map(ranking);
    const along = orders.map((designs) => {
      const ranks = [];
      designs.forEach((design, rank) => (ranks[design] = 1 - rank / designs.length));
      return ranks;
    });
    const at = (share) => MARGIN + share * (size - 2 * MARGIN);
    points = along[0].map((share, i) => [at(share), size - at(along[1][i])]);
    [order] = orders;
  }

  function ring(design, text = "") {
    if (!points[design]) return;
    const [x, y] = points[design];
    pen.beginPath();
    pen.arc(x, y, 7, 0, 2 * Math.PI);
    pen.stroke();
    pen.fillText(text, x + (x < size - 40 ? 18 : -18), y + 5);
  }

  function draw() {
    const colours = getComputedStyle(canvas);
    const of = (name) => colours.getPropertyValue(name);
    pen.clearRect(0, 0, size, size);
    const dot = (design, width) => pen.fillRect(points[design][0] - width / 2, points[design][1] - width / 2, width, width);
    pen.fillStyle = of("--dot");
    order.slice(TOP).forEach((design) => dot(design, 2.5));
    pen.fillStyle = of("--best");
    order.slice(0, TOP).forEach((design) => dot(design, 6));
    pen.strokeStyle = pen.fillStyle = of("--ink");
    pen.lineWidth = 2.5;
    pen.font = "bold 17px system-ui, sans-serif";
    pen.textAlign = "center";
    for (const [letter, design] of Object.entries(shown.marks)) if (design) ring(design, letter);
    if (shown.point !== null) ring(shown.point);
  }

  canvas.addEventListener("pointermove", (event) => onPoint(near(event)));
  canvas.addEventListener("pointerleave", () => onPoint(null));
  canvas.addEventListener("click", (event) => {
    const design = near(event);
    if (design !== null) onPick(design);
  });

  return ({ fitness, ...what }) => {
    shown = { ...shown, ...what };
    if (fitness) place(fitness);
    draw();
  };
}
