// Small drawings of robots, and the diagram in which one is drawn by clicking its voxels.

import { element } from "./dom.js";

const AZIMUTH = (-62 * Math.PI) / 180; // as the replay begins
const ELEVATION = (27 * Math.PI) / 180;
const TOWARDS = [Math.cos(AZIMUTH), Math.sin(AZIMUTH)];

const NAMES = ["absent", "passive", "active"];
const FILLS = [null, [77, 214, 237], [242, 69, 56]]; // of softvox_gym.rendering

// The three faces that are seen, as corners of the unit cube, and how bright they are.
const FACES = [
  [[[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], 1],
  [[[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], 0.84],
  [[[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]], 0.66],
];

/** The digits d_0 d_1 ... of a design, as a text. */
export function digitsOf(design) {
  return Array.from({ length: 8 }, (_, i) => Math.floor(design / 3 ** i) % 3).join("");
}

/** Where a site is: [x, y, z]. */
function siteOf(i) {
  return [i & 1, (i >> 1) & 1, i >> 2];
}

function project([x, y, z]) {
  const [u, v] = [x - 1, y - 1];
  const right = -TOWARDS[1] * u + TOWARDS[0] * v;
  const down = Math.sin(ELEVATION) * (TOWARDS[0] * u + TOWARDS[1] * v);
  return [right, down - Math.cos(ELEVATION) * (z - 1)];
}

function nearness(i) {
  const [x, y, z] = siteOf(i);
  return (x * TOWARDS[0] + y * TOWARDS[1]) * Math.cos(ELEVATION) + z * Math.sin(ELEVATION);
}

/** Fill an SVG (viewBox -1.7 -1.9 3.4 3.3) with a robot. */
export function drawRobot(svg, digits) {
  const order = [...digits].map((_, i) => i).sort((a, b) => nearness(a) - nearness(b));
  const parts = order.filter((i) => digits[i] !== "0").flatMap((i) => cube(siteOf(i), digits[i]));
  const empty = { x: 0, y: 0, "font-size": 0.5, "text-anchor": "middle", text: "empty" };
  svg.replaceChildren(...(parts.length ? parts : [element("svg:text", empty)]));
}

function cube(site, digit) {
  const faces = FACES.map(([corners, light]) => {
    const points = corners.map((corner) => project(corner.map((c, k) => c + site[k])));
    const fill = `rgb(${FILLS[digit].map((c) => Math.round(c * light)).join(" ")})`;
    const shape = { points: points.join(" "), fill, stroke: "#1a1f29", "stroke-width": 0.04 };
    return element("svg:polygon", { ...shape, "stroke-linejoin": "round" });
  });
  if (digit === "2") {
    // The dot tells active voxels from passive ones without colour.
    for (const place of [[0.5, 0.5, 1], [0.5, 0, 0.5], [1, 0.5, 0.5]]) {
      const [cx, cy] = project(place.map((c, k) => c + site[k]));
      faces.push(element("svg:circle", { cx, cy, r: 0.1, fill: "#1a1f29" }));
    }
  }
  return faces;
}

/** The 2 x 2 x 2 diagram: each click takes a voxel from absent to passive to active. */
export class Editor {
  #digits = "00000000";
  #buttons = [];

  /** Fill an element; calls onChange(digits). */
  constructor(parent, onChange) {
    for (const z of [1, 0]) {
      const legend = element("legend", { text: z ? "upper layer" : "lower layer" });
      const buttons = [2, 3, 0, 1].map((place) => this.#button(place + 4 * z, onChange));
      parent.append(element("fieldset", {}, legend, ...buttons));
    }
    const text = "Click a voxel: absent, passive, active. x to the right, y upward.";
    parent.append(element("p", { class: "quiet-text", text }));
  }

  #button(i, onChange) {
    const button = element("button", { type: "button", "data-site": i });
    button.addEventListener("click", () => {
      const digits = [...this.#digits];
      digits[i] = (Number(digits[i]) + 1) % 3;
      this.show(digits.join(""));
      onChange(this.#digits);
    });
    this.#buttons[i] = button;
    return button;
  }

  /** Show a design. */
  show(digits) {
    this.#digits = digits;
    this.#buttons.forEach((button, i) => {
      const [x, y, z] = siteOf(i);
      const name = NAMES[digits[i]];
      button.className = `voxel ${name}`;
      button.textContent = ["·", "P", "A"][digits[i]];
      button.setAttribute("aria-label", `x ${x}, y ${y}, z ${z}: ${name}`);
    });
  }
}
