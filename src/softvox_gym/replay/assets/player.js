/**
 * SoftvoxPlayer: shows recordings of soft robots in 3-D, with controls.
 *
 *     import { SoftvoxPlayer } from "./player.js";
 *     const player = new SoftvoxPlayer(element, recording, { autoplay: false });
 *     player.seek(120);
 *     element.addEventListener("frame", (event) => console.log(event.detail));
 *
 * A recording is what `softvox_gym.replay.recording` returns, as JSON. The module defines no
 * globals; the element gets the class "softvox-player" (player.css) and the property `player`.
 */

import { drawWave, PUMP, showPhase } from "./pump.js";
import { Scene } from "./scene.js";

const SPEEDS = [0.125, 0.25, 0.5, 1, 2];
const MOST_SECONDS_PER_TICK = 0.1; // a page that was asleep goes on where it was
const ORBIT_PER_PIXEL = 0.4; // degrees
const ORBIT_PER_KEY = 5; // degrees
const ZOOM_PER_KEY = 1.1;
const VIEW = { azimuth: -62, elevation: 27, zoom: 1 };
const LIMITS = { elevation: [3, 90], zoom: [0.25, 8] };

const HELP = `drag or arrow keys: orbit; wheel, pinch, + and -: zoom; space: play or pause;
, and .: one frame back or on; F: follow; Home: the view at the start`;

const CONTROLS = `
  <div class="softvox-stage">
    <canvas tabindex="0" role="img"></canvas>
    <div class="softvox-labels"></div>
    ${PUMP}
  </div>
  <div class="softvox-controls">
    <button type="button" class="play"></button>
    <input type="range" class="frame" min="0" step="1" aria-label="frame">
    <output class="clock"></output>
    <label>speed <select class="speed"></select></label>
    <label><input type="checkbox" class="follow"> follow</label>
    <button type="button" class="reset">reset view</button>
  </div>`;

const clamp = (value, [low, high]) => Math.min(Math.max(value, low), high);

/** Plays recordings in an element; each robot has a panel, and all share one camera. */
export class SoftvoxPlayer {
  #element;
  #find = (selector) => this.#element.querySelector(selector);
  #fallback; // what the element held before
  #listeners = new AbortController();
  #sizes = null; // ResizeObserver
  #scene = null;
  #recording = null;
  #view = { ...VIEW };
  #frame = 0;
  #time = 0; // of the clock, simulated seconds; between frames while playing
  #tick = 0; // the animation frame asked for, 0 where paused
  #pointers = new Map();

  /**
   * @param {HTMLElement} element Filled by the player. Where there is no WebGL 2 it keeps what it
   *   held (a still picture, say) under a message.
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
    if (!this.#build(speed)) return;
    if (recording) {
      this.load(recording);
      const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (autoplay && !still) this.play();
    }
  }

  /** Whether the robots can be drawn: false where the browser has no WebGL 2. */
  get supported() {
    return this.#scene !== null;
  }

  /** The frame shown, from 0. */
  get frame() {
    return this.#frame;
  }

  /** How many frames the recording has. */
  get frames() {
    return this.#recording?.frames ?? 0;
  }

  /** Whether the clock runs. */
  get playing() {
    return this.#tick !== 0;
  }

  /** The view: azimuth and elevation in degrees, zoom (1 shows all), whether it follows. */
  get view() {
    return { ...this.#view, follow: this.#find(".follow")?.checked ?? true };
  }

  set view({ follow, ...change }) {
    Object.assign(this.#view, change);
    for (const [name, limits] of Object.entries(LIMITS)) {
      this.#view[name] = clamp(this.#view[name], limits);
    }
    if (follow !== undefined) this.#find(".follow").checked = follow;
    this.#draw();
  }

  /** Show another recording from its start; the view, the speed and whether it plays stay. */
  load(recording) {
    if (recording.format !== "softvox-replay" || recording.version !== 1) {
      throw new Error("not a recording that this player knows: softvox-replay, version 1");
    }
    this.#recording = recording;
    if (!this.supported) return;
    this.#scene.load(recording);
    this.#find(".frame").max = recording.frames - 1;
    const labels = recording.robots.map((robot) => {
      const label = document.createElement("div");
      label.textContent = robot.label;
      return label;
    });
    this.#find(".softvox-labels").replaceChildren(...labels);
    const names = recording.robots.map((robot) => robot.label).join("; ");
    this.#find("canvas").setAttribute("aria-label", `${names}. ${HELP}`);
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
      this.#advance(passed * Number(this.#find(".speed").value));
    };
    this.#tick = requestAnimationFrame(tick);
    this.#showPlaying();
  }

  /** Stop the clock. */
  pause() {
    cancelAnimationFrame(this.#tick);
    this.#tick = 0;
    if (this.supported) this.#showPlaying();
  }

  /** Return what is shown as the data URL of a PNG. */
  picture() {
    this.#draw();
    return this.#find("canvas").toDataURL("image/png");
  }

  /** Give everything back: the element is as it was before. */
  destroy() {
    this.pause();
    this.#listeners.abort();
    this.#sizes?.disconnect();
    this.#scene?.destroy();
    this.#scene = null;
    this.#recording = null;
    this.#element.replaceChildren(...this.#fallback);
    this.#element.classList.remove("softvox-player");
    delete this.#element.player;
  }

  /** Fill the element; return whether there is WebGL. */
  #build(speed) {
    const content = document.createElement("template");
    content.innerHTML = CONTROLS;
    const canvas = content.content.querySelector("canvas");
    this.#scene = Scene.on(canvas);
    if (!this.#scene) {
      const message = document.createElement("p");
      message.className = "softvox-message";
      message.textContent =
        "This browser shows no WebGL 2, which the moving robots need; here is a still picture. " +
        "Switch on hardware acceleration in its settings, or take another browser.";
      this.#element.prepend(message);
      return false;
    }
    this.#element.replaceChildren(content.content);
    canvas.title = HELP;
    this.#fillSpeeds(speed);
    drawWave(this.#find(".softvox-pump"));
    this.#find(".follow").checked = true;
    this.#listen(canvas);
    this.#showPlaying();
    return true;
  }

  #fillSpeeds(speed) {
    const select = this.#find(".speed");
    const speeds = [...new Set([...SPEEDS, speed])].sort((a, b) => a - b);
    select.replaceChildren(...speeds.map((value) => new Option(`${value}×`, value)));
    select.value = String(speed);
  }

  #listen(canvas) {
    const signal = this.#listeners.signal;
    const on = (target, type, handler, options = {}) =>
      target.addEventListener(type, handler, { signal, ...options });
    on(this.#find(".play"), "click", () => this.#toggle());
    on(this.#find(".frame"), "input", (event) => {
      this.pause();
      this.seek(Number(event.target.value));
    });
    on(this.#find(".follow"), "change", () => this.#draw());
    on(this.#find(".reset"), "click", () => (this.view = VIEW));
    on(canvas, "keydown", (event) => this.#key(event));
    on(canvas, "wheel", (event) => this.#wheel(event), { passive: false });
    on(canvas, "pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#pointers.set(event.pointerId, event);
    });
    on(canvas, "pointermove", (event) => this.#drag(event));
    for (const type of ["pointerup", "pointercancel"]) {
      on(canvas, type, (event) => this.#pointers.delete(event.pointerId));
    }
    on(canvas, "webglcontextlost", (event) => event.preventDefault());
    on(canvas, "webglcontextrestored", () => {
      this.#scene = Scene.on(canvas);
      if (this.#recording) this.#scene.load(this.#recording);
      this.#draw();
    });
    this.#sizes = new ResizeObserver(() => this.#draw());
    this.#sizes.observe(canvas);
  }

  #toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  #key(event) {
    const turn = (name, by) => (this.view = { [name]: this.#view[name] + by });
    const actions = {
      ArrowLeft: () => turn("azimuth", -ORBIT_PER_KEY),
      ArrowRight: () => turn("azimuth", ORBIT_PER_KEY),
      ArrowUp: () => turn("elevation", ORBIT_PER_KEY),
      ArrowDown: () => turn("elevation", -ORBIT_PER_KEY),
      "+": () => this.#zoom(ZOOM_PER_KEY),
      "=": () => this.#zoom(ZOOM_PER_KEY),
      "-": () => this.#zoom(1 / ZOOM_PER_KEY),
      ",": () => (this.pause(), this.seek(this.#frame - 1)),
      ".": () => (this.pause(), this.seek(this.#frame + 1)),
      " ": () => this.#toggle(),
      f: () => (this.view = { follow: !this.view.follow }),
      Home: () => (this.view = VIEW),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  }

  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 0 ? event.deltaY / 40 : event.deltaY;
    this.#zoom(ZOOM_PER_KEY ** -clamp(lines, [-4, 4]));
  }

  #zoom(factor) {
    this.view = { zoom: this.#view.zoom * factor };
  }

  /** One pointer orbits, two zoom. */
  #drag(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const spread = () => {
      const [a, b] = [...this.#pointers.values()];
      return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY) || 1;
    };
    const two = this.#pointers.size === 2;
    const apart = two ? spread() : 1;
    this.#pointers.set(event.pointerId, event);
    if (two) {
      this.#zoom(spread() / apart);
    } else if (this.#pointers.size === 1) {
      const { azimuth, elevation } = this.#view;
      this.view = {
        azimuth: azimuth - (event.clientX - before.clientX) * ORBIT_PER_PIXEL,
        elevation: elevation + (event.clientY - before.clientY) * ORBIT_PER_PIXEL,
      };
    }
  }

  #advance(seconds) {
    const { frames, seconds_per_frame: step } = this.#recording;
    this.#time = (this.#time + seconds) % (frames * step);
    const frame = Math.min(Math.floor(this.#time / step + 1e-6), frames - 1);
    if (frame !== this.#frame) this.#show(frame);
  }

  #show(frame) {
    this.#frame = frame;
    if (!this.supported) return;
    this.#draw();
    const { seconds_per_frame: step, settle_time: settle, frequency_hz } = this.#recording;
    const time = frame * step;
    const cycle = Math.max(0, (time - settle) * frequency_hz);
    this.#find(".frame").value = frame;
    this.#find(".clock").value = `${time.toFixed(2)} s`;
    showPhase(this.#find(".softvox-pump"), cycle, time < settle);
    const detail = { frame, time, cycle };
    this.#element.dispatchEvent(new CustomEvent("frame", { detail }));
  }

  #showPlaying() {
    this.#find(".play").textContent = this.playing ? "pause" : "play";
  }

  #draw() {
    if (!this.supported || !this.#recording) return;
    const panels = this.#scene.draw(this.#frame, this.view);
    [...this.#find(".softvox-labels").children].forEach((label, i) => {
      for (const [name, value] of Object.entries(panels[i])) label.style[name] = `${value}px`;
    });
  }
}
