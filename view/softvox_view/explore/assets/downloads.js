// What can be kept: the table of all designs, and the map with its scale.

import { digitsOf } from "./robot.js";

const MARGIN = 16;
const BAR = 14;
const LINE = 20;

/** All designs as they are now, as CSV; the numbers carry every bit. */
export function csvOf(atlas, values) {
  const rows = values.fitness.map((fitness, i) => [
    i,
    digitsOf(i),
    values.dx[i] ?? "",
    values.dy[i] ?? "",
    fitness ?? "",
    fitness === null ? "diverged" : "ok",
    atlas.fitness[i],
    atlas.noise[i],
  ]);
  const head = "design,digits,dx,dy,fitness,status,fitness_published,mean_under_noise";
  return `${[head, ...rows.map((row) => row.join(","))].join("\n")}\n`;
}

/** The map's canvas as a PNG: under it its scale with three words, and a line about the physics. */
export function pictureOf(map, scale, words, physics) {
  const all = document.createElement("canvas");
  all.width = map.width + 2 * MARGIN;
  all.height = MARGIN + map.height + MARGIN + BAR + 2 * LINE + MARGIN;
  const pen = all.getContext("2d");
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, all.width, all.height);
  pen.drawImage(map, MARGIN, MARGIN);
  const below = MARGIN + map.height + MARGIN;
  pen.drawImage(scale, MARGIN, below, map.width, BAR);
  pen.fillStyle = "#1a1f29";
  pen.font = "15px system-ui, sans-serif";
  const places = { left: MARGIN, center: all.width / 2, right: all.width - MARGIN };
  Object.entries(places).forEach(([align, x], k) => {
    pen.textAlign = align;
    pen.fillText(words[k], x, below + BAR + LINE - 2);
  });
  pen.textAlign = "center";
  pen.fillText(physics, all.width / 2, below + BAR + 2 * LINE, map.width);
  return new Promise((resolve) => all.toBlob(resolve));
}

/** A file's name that tells what differs from the published physics. */
export function nameOf(what, parameters) {
  const changes = Object.entries(parameters).map(([name, value]) => `_${name}_${value}`);
  return `${what}${changes.join("")}`.replace(/[^\w.+-]/g, "");
}
