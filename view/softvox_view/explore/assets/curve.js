// The best fitness so far along searchers' paths.

import { evaluationColour } from "./colours.js";
import { element } from "./page.js";
import { bestUpto } from "./panels.js";
import { MARKERS } from "./sheet.js";

const [LEFT, RIGHT, UP, DOWN] = [46, 290, 12, 132]; // the ends of the axes

/** Draw the curves of paths; return a function that moves their cursor to an evaluation. */
export function drawCurves(svg, paths, fitness) {
  const most = Math.max(...paths.map(({ designs }) => designs.length));
  const optimum = Math.max(...fitness);
  const x = (count) => LEFT + ((RIGHT - LEFT) * (count - 1)) / Math.max(1, most - 1);
  const y = (value) => DOWN - ((DOWN - UP) * value) / (1.05 * optimum);
  const line = (x1, y1, x2, y2, more) => element("svg:line", { x1, y1, x2, y2, stroke: "currentColor", ...more });
  const write = (text, x, y, anchor, more) => element("svg:text", { text, x, y, "text-anchor": anchor, ...more });
  const curves = paths.map(({ best, designs, colour }) => {
    const steps = best.map(({ design, at }, i) => `${i ? "H" : "M"}${x(at + 1)}${i ? "V" : " "}${y(fitness[design])}`);
    const attributes = { d: `${steps.join("")}H${x(designs.length)}`, fill: "none", stroke: colour, "stroke-width": 2 };
    return element("svg:path", attributes);
  });
  // The axis itself is the key of the dots' colours.
  const key = Array.from({ length: 50 }, (_, k) => {
    const width = (RIGHT - LEFT) / 50;
    const place = { x: LEFT + k * width, y: DOWN + 4, width: width + 0.5, height: 7 };
    return element("svg:rect", { ...place, fill: evaluationColour(k / 49) });
  });
  const cursor = line(0, UP, 0, DOWN + 12, { "stroke-width": 1.5 });
  const ends = paths.map(({ colour }, k) => markerOf(k, { fill: colour }));
  svg.replaceChildren(
    line(LEFT, DOWN, RIGHT, DOWN), line(LEFT, UP, LEFT, DOWN),
    line(LEFT, y(optimum), RIGHT, y(optimum), { "stroke-dasharray": "5 4" }),
    write(`optimum ${optimum.toFixed(2)}`, LEFT + 6, y(optimum) + 14, "start"),
    write("0", LEFT - 5, DOWN + 4, "end"), write(optimum.toFixed(1), LEFT - 5, y(optimum) + 4, "end"),
    write("1", LEFT, DOWN + 25, "middle"), write(most, RIGHT, DOWN + 25, "end"),
    write("evaluation, and the colour of its dot", (LEFT + RIGHT) / 2, DOWN + 40, "middle"),
    write("best so far", 0, 0, "middle", { transform: `translate(14 ${(UP + DOWN) / 2}) rotate(-90)` }),
    write("voxel widths", 0, 0, "middle", { transform: `translate(28 ${(UP + DOWN) / 2}) rotate(-90)` }),
    ...key, ...curves, cursor, ...ends,
  );
  return (upto) => {
    for (const end of ["x1", "x2"]) cursor.setAttribute(end, x(Math.max(upto, 1)));
    paths.forEach((path, k) => {
      const best = bestUpto(path, upto);
      const place = best ? [x(Math.min(upto, path.designs.length)), y(fitness[best.design])] : [-9, -9];
      ends[k].setAttribute("transform", `translate(${place.join(" ")}) scale(4)`);
    });
  };
}

/** The marker that distinguishes a path, 1 in size. */
export function markerOf(k, attributes) {
  return element("svg:polygon", { points: MARKERS[k].join(" "), stroke: "#000", "stroke-width": 0.25, ...attributes });
}
