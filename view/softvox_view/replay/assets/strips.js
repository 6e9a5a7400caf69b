/** Curves under a player, in step with it: each robot's distance and volume. */

const STRIP_HEIGHT = 100;
const DASHES = ["none", "7 3", "2 2"]; // not everybody can distinguish robots by colour alone
const MOST_CYCLES = 60; // with more, their lines would be a grey area

const STRIPS = {
  distance: { of: (body, frame) => body.gone(frame), least: [0, 0.1], word: "distance, voxel widths" },
  volume: { of: (body, frame) => body.volume(frame), least: [1, 1.1], word: "volume, relative to rest" },
};

/** If a robot explodes, its volume may not be finite. */
const told = (value) => (Number.isFinite(value) ? value.toFixed(2) : "–");

/** The colour of a robot's line, in a recording with `count` robots. */
export function colourOf(i, count) {
  const hue = (260 + (360 * i) / count) % 360;
  return count > 1 ? `light-dark(oklch(0.5 0.16 ${hue}), oklch(0.78 0.13 ${hue}))` : "currentcolor";
}

/** Curves over a recording's frames, with a cursor; a click goes to that moment. */
export class Strips {
  #element;
  #curves = []; // for each strip, the values of each robot at each frame
  #frames = 1;

  constructor(element, seek, signal) {
    this.#element = element;
    const strip = (name) => `<figure><figcaption></figcaption>
      <svg class="${name}" viewBox="0 0 1000 ${STRIP_HEIGHT}" preserveAspectRatio="none" role="img"></svg></figure>`;
    element.innerHTML = Object.keys(STRIPS).map(strip).join("");
    const go = (event) => {
      const { left, width } = event.currentTarget.getBoundingClientRect();
      if (event.buttons & 1) seek(((event.clientX - left) / width) * (this.#frames - 1));
    };
    for (const svg of element.querySelectorAll("svg")) {
      for (const type of ["pointerdown", "pointermove"]) svg.addEventListener(type, go, { signal });
    }
  }

  /** Load the robots of a recording. */
  load({ frames, settle_time, seconds_per_frame, frequency_hz, cycles }, bodies) {
    this.#frames = frames;
    const across = (frame) => (1000 * frame) / Math.max(1, frames - 1);
    const count = cycles > MOST_CYCLES ? 0 : Math.floor(Math.max(cycles, 0)) + 1;
    const begins = Array.from({ length: count }, (_, k) => across((settle_time + k / frequency_hz) / seconds_per_frame));
    const lines = begins.map((x) => `M${x} 0V${STRIP_HEIGHT}`).join("");
    this.#curves = Object.values(STRIPS).map(({ of }) =>
      bodies.map((body) => Array.from({ length: frames }, (_, frame) => of(body, frame))),
    );
    this.#element.querySelectorAll("svg").forEach((svg, k) => {
      const { least, word } = Object.values(STRIPS)[k];
      const all = [...least, ...this.#curves[k].flat()].filter(Number.isFinite);
      const [low, high] = [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
      const up = (value) => 4 + (STRIP_HEIGHT - 8) * (1 - (value - low) / (high - low));
      const drawn = this.#curves[k].map((curve, i) => {
        const points = curve.flatMap((value, frame) =>
          Number.isFinite(value) ? `${across(frame).toFixed(1)},${up(value).toFixed(1)}` : [],
        );
        const look = `stroke: ${colourOf(i, bodies.length)}; stroke-dasharray: ${DASHES[i % DASHES.length]}`;
        return `<polyline style="${look}" points="${points.join(" ")}"/>`;
      });
      svg.innerHTML = `<path class="cycles" d="${lines}"/>${drawn.join("")}<path class="cursor"/>`;
      svg.setAttribute("aria-label", `${word}, up to ${high.toFixed(2)}; a line per cycle`);
    });
  }

  show(frame) {
    const x = (1000 * frame) / Math.max(1, this.#frames - 1);
    this.#element.querySelectorAll("figure").forEach((figure, k) => {
      figure.querySelector(".cursor").setAttribute("d", `M${x} 0V${STRIP_HEIGHT}`);
      const curves = this.#curves[k];
      const value = (curve, i) => `<b style="color: ${colourOf(i, curves.length)}">${told(curve[frame])}</b>`;
      const values = curves.slice(0, 4).map(value).join(" ");
      figure.querySelector("figcaption").innerHTML = `${Object.values(STRIPS)[k].word}: ${values}`;
    });
  }
}
