/**
 * SoftvoxPlayer: shows recordings of soft robots in 3-D, with controls.
 *
 *     import { SoftvoxPlayer } from "./player.js";
 *     const player = new SoftvoxPlayer(element, recording, { autoplay: false });
 *     player.seek(120);
 *     element.addEventListener("frame", (event) => console.log(event.detail));
 *
 * A recording is what `softvox_view.replay.recording` returns, as JSON. The module defines no
 * globals; the element gets the class "softvox-player" (player.css) and the property `player`.
 */

import { HELP, listen } from "./input.js";
import { Scene } from "./scene.js";

const SPEEDS = [0.125, 0.25, 0.5, 1, 2];
const MOST_SECONDS_PER_TICK = 1; // a page that was asleep goes on where it was
const VIEW = { azimuth: -62, elevation: 27, zoom: 1 };
const LIMITS = { elevation: [3, 90], zoom: [0.25, 3] };
const SMALL = 220; // CSS pixels; a panel less wide has a short label

const NO_WEBGL = `This browser shows no WebGL 2, which the moving robots need; here is a still picture.
Switch on hardware acceleration in its settings, or take another browser.`;
const LOST = `The browser took the graphics away, as it does where many moving pictures are open; here
is a still one. Close some, or reload the page.`;

// The phase of the pump: one cycle of its sine, and a dot at where it is.
const sine = (phase) => 26 - 20 * Math.sin(2 * Math.PI * phase);
const WAVE = Array.from({ length: 47 }, (_, i) => `${4 + 2 * i} ${sine(i / 46)}`).join("L");

const CONTROLS = `
  <div class="softvox-stage">
    <canvas tabindex="0" role="application"></canvas>
    <div class="softvox-labels"></div>
    <svg class="softvox-pump" viewBox="0 0 100 64" role="img" aria-label="phase of the pump">
      <path stroke-dasharray="3 3" stroke-width="0.8" d="M4 26 H96"></path>
      <path stroke-width="1.6" d="M${WAVE}"></path>
      <circle r="4.5"></circle>
      <text x="50" y="60" text-anchor="middle"></text>
    </svg>
  </div>
  <div class="softvox-controls">
    <button type="button" class="play"></button>
    <input type="range" class="frame" min="0" step="1" aria-label="frame">
    <span class="clock"></span>
    <label>speed <select class="speed"></select></label>
    <label><input type="checkbox" class="follow" checked> follow</label>
    <button type="button" class="reset">reset view</button>
  </div>`;

const clamp = (value, [low, high]) => Math.min(Math.max(value, low), high);

/** Plays recordings in an element; each robot has a panel, and all share one camera. */
export class SoftvoxPlayer {
  #element;
  #find = (selector) => this.#element.querySelector(selector);
  #fallback; // what the element held before
  #still = null; // the address of a picture of the recording
  #listeners = new AbortController();
  #sizes = new ResizeObserver(() => this.#draw());
  #scene = null;
  #recording = null;
  #view = { ...VIEW };
  #frame = 0;
  #time = 0; // of the clock, simulated seconds; between frames while playing
  #tick = 0; // the animation frame asked for, 0 where paused

  /**
   * @param {HTMLElement} element Filled by the player. What it held (a still picture, say) is shown
   *   under a message while there is no WebGL 2.
   * @param {object} [recording] Shown at once.
   * @param {object} [options]
   * @param {boolean} [options.autoplay=true] Never where the reader asked for reduced motion.
   * @param {number} [options.speed=0.5] 1 is real time.
   */
  constructor(element, recording = null, { autoplay = true, speed = 0.5 } = {}) {
    this.#element = element;
    this.#fallback = [...element.childNodes];
    element.player = this;
    element.classList.add("softvox-player");
    element.innerHTML = CONTROLS;
    const canvas = this.#find("canvas");
    canvas.title = HELP;
    this.#scene = Scene.on(canvas);
    this.#sizes.observe(canvas);
    const speeds = [...new Set([...SPEEDS, speed])].sort((a, b) => a - b);
    this.#find(".speed").replaceChildren(...speeds.map((value) => new Option(`${value}×`, value)));
    this.#find(".speed").value = String(speed);
    this.#listen(canvas);
    this.#showPlaying();
    this.#cover();
    if (recording) {
      this.load(recording);
      if (autoplay) this.autoplay();
    }
  }

  get supported() {
    return this.#scene !== null;
  }

  get frame() {
    return this.#frame;
  }

  get frames() {
    return this.#recording?.frames ?? 0;
  }

  get playing() {
    return this.#tick !== 0;
  }

  /**
   * The view: azimuth and elevation in degrees, zoom, whether it follows. At zoom 1 all is seen: of
   * the robot where it follows, else of its path.
   */
  get view() {
    return { ...this.#view, follow: this.#find(".follow").checked };
  }

  set view({ follow, ...change }) {
    Object.assign(this.#view, change);
    for (const [name, limits] of Object.entries(LIMITS)) {
      this.#view[name] = clamp(this.#view[name], limits);
    }
    if (follow !== undefined) this.#find(".follow").checked = follow;
    this.#draw();
  }

  /**
   * Show another recording from its start; the view, the speed and whether it plays stay.
   *
   * @param {object} recording
   * @param {string} [still] The address of a picture, shown where the robots can't be drawn; else it
   *   is what the element held before.
   */
  load(recording, still = null) {
    if (recording.format !== "softvox-replay" || recording.version !== 2) {
      throw new Error("not a recording that this player knows: softvox-replay, version 2");
    }
    this.#recording = recording;
    this.#still = still;
    this.#scene?.load(recording);
    this.#cover();
    this.#find(".frame").max = recording.frames - 1;
    const labels = "<div><span></span></div>".repeat(recording.robots.length);
    this.#find(".softvox-labels").innerHTML = labels;
    this.#find("canvas").setAttribute("aria-label", `${this.#names}. ${HELP}`);
    this.seek(0);
  }

  /** Show a frame; a number outside the recording is taken to its nearest end. */
  seek(frame) {
    if (!this.#recording) return;
    this.#show(clamp(Math.round(frame) || 0, [0, this.frames - 1]));
    this.#time = this.#frame * this.#recording.seconds_per_frame;
  }

  /** Run the clock; past the last frame it begins again. */
  play() {
    if (!this.supported || this.playing || !this.#recording) return;
    let before = null;
    const tick = (now) => {
      this.#tick = requestAnimationFrame(tick);
      const passed = Math.min((now - (before ?? now)) / 1000, MOST_SECONDS_PER_TICK);
      before = now;
      const { frames, seconds_per_frame: step } = this.#recording;
      this.#time = (this.#time + passed * this.#find(".speed").value) % (frames * step);
      const frame = Math.min(Math.floor(this.#time / step + 1e-6), frames - 1);
      if (frame !== this.#frame) this.#show(frame);
    };
    this.#tick = requestAnimationFrame(tick);
    this.#showPlaying();
  }

  /** Go some frames on, or back, and stop there. */
  step(frames) {
    this.pause();
    this.seek(this.#frame + frames);
  }

  /** Play unless the reader asked for reduced motion. */
  autoplay() {
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  pause() {
    cancelAnimationFrame(this.#tick);
    this.#tick = 0;
    this.#showPlaying();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Orbit by some degrees. */
  turn(azimuth, elevation) {
    const view = this.#view;
    this.view = { azimuth: view.azimuth + azimuth, elevation: view.elevation + elevation };
  }

  zoom(factor) {
    this.view = { zoom: this.#view.zoom * factor };
  }

  /** Take the view at the start. */
  reset() {
    this.view = VIEW;
  }

  /** Return what is shown as the data URL of a PNG; null where nothing can be drawn. */
  picture() {
    if (!this.supported) return null;
    this.#draw();
    return this.#find("canvas").toDataURL("image/png");
  }

  /** Give everything back: the element is as it was before. */
  destroy() {
    this.pause();
    this.#listeners.abort();
    this.#sizes.disconnect();
    this.#scene?.destroy();
    this.#scene = null;
    this.#recording = null;
    this.#element.replaceChildren(...this.#fallback);
    this.#element.classList.remove("softvox-player", "softvox-still");
    delete this.#element.player;
  }

  #listen(canvas) {
    const { signal } = this.#listeners;
    const on = (target, type, handler) => target.addEventListener(type, handler, { signal });
    on(this.#find(".play"), "click", () => this.toggle());
    on(this.#find(".frame"), "input", (event) => {
      this.pause();
      this.seek(Number(event.target.value));
    });
    on(this.#find(".follow"), "change", () => this.#draw());
    on(this.#find(".reset"), "click", () => this.reset());
    listen(canvas, this, signal);
    on(canvas, "webglcontextlost", (event) => {
      event.preventDefault(); // or it could not come back
      this.pause();
      this.#scene = null;
      this.#cover(LOST);
    });
    on(canvas, "webglcontextrestored", () => {
      this.#scene = Scene.on(canvas);
      if (this.#recording) this.#scene?.load(this.#recording);
      this.#cover(LOST);
      this.#show(this.#frame);
    });
  }

  get #names() {
    return this.#recording.robots.map((robot) => robot.label).join("; ");
  }

  /** Show a message and a still picture while the browser gives no graphics; else take them away. */
  #cover(reason = this.#find(".softvox-message")?.textContent ?? NO_WEBGL) {
    this.#find(".softvox-lost")?.remove();
    this.#element.classList.toggle("softvox-still", !this.supported);
    if (this.supported) return;
    const made = (tag, values) => Object.assign(document.createElement(tag), values);
    const cover = made("div", { className: "softvox-lost" });
    const shown = this.#still
      ? [made("img", { src: this.#still, alt: this.#names })]
      : this.#fallback.map((node) => node.cloneNode(true));
    cover.append(made("p", { className: "softvox-message", textContent: reason }), ...shown);
    this.#find(".softvox-stage").append(cover);
  }

  #show(frame) {
    this.#frame = frame;
    if (!this.#recording) return;
    this.#draw();
    const { seconds_per_frame: step, settle_time: settle, frequency_hz } = this.#recording;
    const time = frame * step;
    const cycle = Math.max(0, (time - settle) * frequency_hz);
    this.#find(".frame").value = frame;
    this.#find(".clock").textContent = `${time.toFixed(2)} s`;
    this.#find(".frame").setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
    this.#find(".softvox-pump").classList.toggle("settling", time < settle);
    this.#find(".softvox-pump circle").setAttribute("cx", 4 + 92 * (cycle % 1));
    this.#find(".softvox-pump circle").setAttribute("cy", sine(cycle % 1));
    const words = time < settle ? "settling" : `cycle ${Math.floor(cycle + 1e-9) + 1}`;
    this.#find(".softvox-pump text").textContent = words;
    this.#element.dispatchEvent(new CustomEvent("frame", { detail: { frame, time, cycle } }));
  }

  #showPlaying() {
    this.#find(".play").textContent = this.playing ? "pause" : "play";
  }

  #draw() {
    if (!this.supported || !this.#recording) return;
    const panels = this.#scene.draw(this.#frame, this.view);
    [...this.#find(".softvox-labels").children].forEach((label, i) => {
      for (const [name, value] of Object.entries(panels[i])) label.style[name] = `${value}px`;
      const { label: whole, short_label: short } = this.#recording.robots[i];
      const isSmall = panels[i].width < SMALL;
      label.classList.toggle("small", isSmall);
      label.firstChild.textContent = isSmall ? short : whole;
    });
  }
}
