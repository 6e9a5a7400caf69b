// Designs as small drawings, and the diagram in which clicks on voxels draw one.

import { element } from "./page.js";
import { digitsOfAll, Refused, SITES } from "./physics.js";

const NAMES = ["absent", "passive", "active"];
const FILLS = [null, [77, 214, 237], [242, 69, 56]]; // of softvox_gym.rendering
const FARTHEST_FIRST = [2, 3, 6, 0, 7, 1, 4, 5];

// The three visible faces: corners of the unit cube, their middle, and their brightness.
const FACES = [
  [[[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [0.5, 0.5, 1], 1],
  [[[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], [0.5, 0, 0.5], 0.84],
  [[[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]], [1, 0.5, 0.5], 0.66],
];

/** The digits d_0 d_1 ... of a design, as a text. */
export function digitsOf(design) {
  return digitsOfAll([Number(design)]).join("");
}

/** The number, as a text, of the design given by a number or digits. */
export function designOf(text) {
  const given = String(text);
  if (/^[012]{8}$/.test(given)) return String(parseInt([...given].reverse().join(""), 3));
  if (/^(0|[1-9]\d{0,3})$/.test(given) && given <= 6560) return given;
  throw new Refused(`design '${given}' is neither a number from 0 to 6560 nor 8 digits 0, 1, 2`);
}

/** Project a point, as seen from azimuth −62° and elevation 27°. */
function project([x, y, z]) {
  const [u, v, w] = [x - 1, y - 1, z - 1];
  return [0.8829 * u + 0.4695 * v, 0.2131 * u - 0.4008 * v - 0.891 * w];
}

/** Fill an SVG (viewBox -1.7 -1.9 3.4 3.3) with a robot. */
export function drawRobot(svg, digits) {
  const parts = FARTHEST_FIRST.filter((i) => digits[i] !== "0").flatMap((i) => cubeOf(i, digits[i]));
  const empty = { x: 0, y: 0, "font-size": 0.5, "text-anchor": "middle", text: "empty" };
  svg.replaceChildren(...(parts.length ? parts : [element("svg:text", empty)]));
}

function cubeOf(i, digit) {
  const placed = (corner) => project(corner.map((c, axis) => c + SITES[i][axis]));
  return FACES.flatMap(([corners, middle, light]) => {
    const fill = `rgb(${FILLS[digit].map((c) => Math.round(c * light)).join(" ")})`;
    const shape = { points: corners.map(placed).join(" "), fill, class: "face", stroke: "#1a1f29", "stroke-width": 0.04 };
    const [cx, cy] = placed(middle);
    // The dot distinguishes active voxels from passive ones without colour.
    const dot = digit === "2" ? [element("svg:circle", { cx, cy, r: 0.1 })] : [];
    return [element("svg:polygon", shape), ...dot];
  });
}

// A voxel looks the same wherever it is, so it is drawn once, from [left, top] of its lowest corner.
const STAMP = { left: -0.05, top: -1.35, across: 1.46, down: 1.62, pixels: 50 };
const stamps = {}; // by digit

function stampOf(digit) {
  const { left, top, across, down, pixels } = STAMP;
  const canvas = new OffscreenCanvas(across * pixels, down * pixels);
  const pen = canvas.getContext("2d");
  const [u, v] = project(SITES[0]);
  pen.setTransform(pixels, 0, 0, pixels, -pixels * (u + left), -pixels * (v + top));
  pen.lineWidth = 0.04;
  for (const part of cubeOf(0, digit)) {
    const [points, fill, x, y, r] = ["points", "fill", "cx", "cy", "r"].map((name) => part.getAttribute(name));
    const shape = new Path2D(points ? `M${points}Z` : "");
    if (!points) shape.arc(x, y, r, 0, 2 * Math.PI);
    pen.fillStyle = fill ?? "#000";
    pen.fill(shape);
    pen.stroke(shape);
  }
  return canvas.transferToImageBitmap();
}

/** Paint a robot about [x, y] of a canvas, with a voxel's width in pixels. */
export function paintRobot(pen, digits, [x, y], width) {
  pen.imageSmoothingEnabled = true;
  for (const i of FARTHEST_FIRST.filter((i) => digits[i] !== "0")) {
    const [u, v] = project(SITES[i]);
    const place = [x + width * (u + STAMP.left), y + width * (v + STAMP.top)];
    pen.drawImage((stamps[digits[i]] ??= stampOf(digits[i])), ...place, width * STAMP.across, width * STAMP.down);
  }
}

/** The URL of a picture of designs as built, side by side. */
export function pictureOfRobots(designs) {
  const parts = designs.map((design, i) => {
    const own = element("svg:svg", { x: 3.4 * i, width: 3.4, height: 3.3, viewBox: "-1.7 -1.9 3.4 3.3" });
    drawRobot(own, digitsOf(design));
    return own;
  });
  const [width, height] = [3.4 * parts.length, 3.3];
  const size = { width: 100 * width, height: 100 * height, viewBox: `0 0 ${width} ${height}` };
  const text = new XMLSerializer().serializeToString(element("svg:svg", size, ...parts));
  return `data:image/svg+xml,${encodeURIComponent(text)}`;
}

/**
 * Fill an element with the 2 x 2 x 2 diagram: each click changes a voxel from absent to passive to
 * active, and calls onChange(digits). Returns a function that shows digits in it.
 */
export function editor(parent, onChange) {
  let shown = "00000000";
  const buttons = SITES.map((_, i) => element("button", { type: "button", "data-site": i }));
  const show = (digits) => {
    shown = digits;
    buttons.forEach((button, i) => {
      const [x, y, z] = SITES[i];
      const name = NAMES[digits[i]];
      button.className = `voxel ${name}`;
      button.textContent = ["·", "P", "A"][digits[i]];
      button.setAttribute("aria-label", `x ${x}, y ${y}, z ${z}: ${name}`);
    });
  };
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => {
      show([...shown].map((digit, k) => (k === i ? (Number(digit) + 1) % 3 : digit)).join(""));
      onChange(shown);
    });
  });
  for (const [text, sites] of [["upper layer", [6, 7, 4, 5]], ["lower layer", [2, 3, 0, 1]]]) {
    const layer = sites.map((i) => buttons[i]);
    parent.append(element("fieldset", {}, element("legend", { text }), ...layer));
  }
  const text = "Click a voxel: absent, passive, active. x to the right, y upward.";
  parent.append(element("p", { class: "quiet-text", text }));
  return show;
}
