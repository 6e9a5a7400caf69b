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

import { Body } from "./bodies.js";
import { composed, filmed, filmType, glb, keep } from "./export.js";
import { Filters } from "./filters.js";
import { HELP, listen } from "./input.js";
import { inkOn, Scene } from "./scene.js";
import { colourOf, Strips } from "./strips.js";

const SPEEDS = [0.125, 0.25, 0.5, 1, 2];
const MOST_SECONDS_PER_TICK = 1; // a page that was asleep continues where it was
const VIEW = { azimuth: 0, elevation: 27, zoom: 1 };
const CELL = 120; // CSS pixels, the least width of a robot in a gallery
const LIMITS = { elevation: [3, 90], zoom: [0.25, 3] };
const BESIDE_NAME = 20; // CSS pixels; if the long name has no room, the short one is shown
const DEEP = 0.02; // voxel widths: a smaller depth below the floor goes unnoticed
const NIGHT = { background: [0.106, 0.125, 0.153], floor: [0.25, 0.28, 0.32], trail: [0.76, 0.62, 0.98] };

const NO_WEBGL = `This browser has no WebGL 2, which the moving robots need, so this is a still picture.
Turn on hardware acceleration in its settings, or use another browser.`;
const LOST = `The browser took the graphics away, as it does if many animations are open, so this is
a still picture. Close some, or reload the page.`;

const NO_FILM = "This browser can't record films: it has no MediaRecorder for a canvas.";
const NO_FULL_SCREEN = "This browser, or the page around this one, does not allow full screen.";

const CONTROLS = `
  <div class="softvox-stage">
    <canvas tabindex="0" role="application"></canvas>
    <div class="softvox-labels"></div>
    <details class="softvox-sunk"><summary title="Why is the body under the floor?">sunk?</summary><p></p></details>
  </div>
  <div class="softvox-strips"></div>
  <div class="softvox-controls">
    <button type="button" class="play"></button>
    <input type="range" class="frame" min="0" step="1" aria-label="frame">
    <span class="clock"></span>
    <label>speed <select class="speed"></select></label>
    <label><input type="checkbox" class="follow"> follow</label>
    <label title="draw each voxel as the cube that it is in the model; otherwise neighbours share corners">
      <input type="checkbox" class="boxes"> boxes</label>
    <button type="button" class="reset">reset view</button>
    <button type="button" class="full">full screen</button>
    <details class="softvox-save"><summary>save</summary><div>
      <button type="button" class="png">PNG</button>
      <button type="button" class="film">MP4</button>
      <button type="button" class="glb" title="the voxels and their movement, for other 3-D programs">glb</button>
    </div></details>
  </div>`;

const made = (tag, values) => Object.assign(document.createElement(tag), values);
const cssOf = (colour) => `rgb(${colour.map((value) => Math.round(255 * value)).join(" ")})`;
const clamp = (value, [low, high]) => Math.min(Math.max(value, low), high);

/** Plays recordings in an element; each robot has a panel, and all share one camera. */
export class SoftvoxPlayer {
  #element;
  #find = (selector) => this.#element.querySelector(selector);
  #fallback; // the element's content before
  #still = null; // the address of a picture of the recording
  #listeners = new AbortController();
  #sizes = new ResizeObserver(() => this.#fit());
  #night = matchMedia("(prefers-color-scheme: dark)");
  #scene = null;
  #strips = null; // a gallery has none, but filters
  #filters = null;
  #shown = null; // numbers of the panels that pass the filters; null for all
  #bodies = [];
  #widths = []; // of the robots' names, CSS pixels
  #recording = null;
  #finishFilm = null; // ends the film that is being made
  #view = { ...VIEW };
  #frame = 0;
  #time = 0; // of the clock, simulated seconds; between frames while playing
  #lap = 0; // how often a recording that loops was shown before
  #tick = 0; // the requested animation frame, 0 if paused

  /**
   * @param {HTMLElement} element Filled by the player. Without WebGL 2, a message and the element's
   *   former content (such as a still picture) are shown.
   * @param {object} [recording] Shown at once.
   * @param {object} [options]
   * @param {boolean} [options.autoplay=true] Ignored if the reader prefers reduced motion.
   * @param {number} [options.speed=0.5] 1 is real time.
   * @param {boolean} [options.boxes=false] Whether voxels are at first boxes, not one skin.
   * @param {boolean} [options.strips=true] Whether there are curves under the robots.
   * @param {boolean} [options.gallery=false] Whether there are filters, for many robots.
   */
  constructor(element, recording = null, options = {}) {
    const { autoplay = true, speed = 0.5, boxes = false, gallery = false, strips = !gallery } = options;
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
    this.#find(".boxes").checked = boxes;
    this.#find(".follow").checked = gallery;
    element.classList.toggle("softvox-gallery", gallery);
    const bar = this.#find(".softvox-strips");
    const { signal } = this.#listeners;
    if (strips) this.#strips = new Strips(bar, (frame) => this.#goto(frame), signal);
    if (gallery) this.#filters = new Filters(bar, (shown) => this.#choose(shown), signal);
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
   * The view: azimuth and elevation in degrees, zoom, whether it follows, whether voxels are boxes. At
   * azimuth 0 the camera looks across each robot's way, which goes to the right. Zoom 1 shows all of
   * the robot if the camera follows it, else all of its path.
   */
  get view() {
    const [follow, boxes] = [".follow", ".boxes"].map((name) => this.#find(name).checked);
    return { ...this.#view, follow, boxes };
  }

  set view({ follow, boxes, ...change }) {
    Object.assign(this.#view, change);
    for (const [name, limits] of Object.entries(LIMITS)) {
      this.#view[name] = clamp(this.#view[name], limits);
    }
    if (follow !== undefined) this.#find(".follow").checked = follow;
    if (boxes !== undefined) this.#find(".boxes").checked = boxes;
    this.#draw();
  }

  /**
   * Show another recording from its start; view, speed and play state stay.
   *
   * @param {object} recording
   * @param {string} [still] The URL of a picture, shown if the robots can't be drawn; by default the
   *   element's former content is shown.
   */
  load(recording, still = null) {
    if (recording.format !== "softvox-replay" || recording.version !== 2) {
      throw new Error("not a recording that this player knows: softvox-replay, version 2");
    }
    this.#recording = recording;
    this.#still = still;
    const { frames, settle_time: settle, seconds_per_frame: step } = recording;
    const begin = Math.min(Math.round(settle / step), frames - 1);
    this.#bodies = recording.robots.map((robot) => new Body(robot, begin));
    const pen = Object.assign(made("canvas", {}).getContext("2d"), { font: getComputedStyle(this.#element).font });
    this.#widths = recording.robots.map(({ label }) => pen.measureText(label).width);
    this.#lap = 0;
    this.#dress();
    this.#cover();
    this.#strips?.load(recording, this.#bodies);
    this.#filters?.load(recording);
    this.#find(".frame").max = frames - 1;
    this.#tellSunk();
    this.#find("canvas").setAttribute("aria-label", `${this.#names}. ${HELP}`);
    this.seek(0);
  }

  /** Show a frame; a number outside the recording means the nearest end. */
  seek(frame) {
    if (!this.#recording) return;
    this.#show(clamp(Math.round(frame) || 0, [0, this.frames - 1]));
    this.#time = this.#frame * this.#recording.seconds_per_frame;
  }

  #goto(frame) {
    this.pause();
    this.seek(frame);
  }

  /** Run the clock; after the last frame it starts again. */
  play() {
    if (!this.supported || this.playing || !this.#recording) return;
    let before = null;
    const tick = (now) => {
      this.#tick = requestAnimationFrame(tick);
      const passed = Math.min((now - (before ?? now)) / 1000, MOST_SECONDS_PER_TICK);
      before = now;
      const { frames, seconds_per_frame: step, robots } = this.#recording;
      const whole = (frames - Number(Boolean(robots[0]?.loops))) * step;
      const time = this.#time + passed * this.#find(".speed").value;
      this.#lap += Math.floor(time / whole);
      this.#time = time % whole;
      const frame = Math.min(Math.floor(this.#time / step + 1e-6), frames - 1);
      if (frame !== this.#frame) this.#show(frame);
    };
    this.#tick = requestAnimationFrame(tick);
    this.#showPlaying();
  }

  /** Go some frames forward, or back, and pause. */
  step(frames) {
    this.pause();
    this.seek(this.#frame + frames);
  }

  /** Play unless the reader prefers reduced motion. */
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

  /** Return to the initial view. */
  reset() {
    this.view = VIEW;
  }

  /** Return the current picture as the data URL of a PNG; null if nothing can be drawn. */
  picture() {
    if (!this.supported) return null;
    this.#draw();
    return this.#find("canvas").toDataURL("image/png");
  }

  /** Free all resources: the element is as it was before. */
  destroy() {
    this.pause();
    this.#listeners.abort();
    this.#sizes.disconnect();
    this.#scene?.destroy();
    this.#scene = null;
    this.#recording = null;
    this.#element.replaceChildren(...this.#fallback);
    this.#element.classList.remove("softvox-player", "softvox-still", "softvox-gallery");
    delete this.#element.player;
  }

  #listen(canvas) {
    const { signal } = this.#listeners;
    const on = (target, type, handler) => target.addEventListener(type, handler, { signal });
    on(this.#find(".play"), "click", () => this.toggle());
    on(this.#find(".frame"), "input", (event) => this.#goto(Number(event.target.value)));
    for (const name of [".follow", ".boxes"]) on(this.#find(name), "change", () => this.#draw());
    on(this.#find(".reset"), "click", () => this.reset());
    on(this.#find(".png"), "click", () => {
      this.#draw();
      composed(canvas, this.#texts).toBlob((content) => keep(content, `${this.#file}.png`));
    });
    on(this.#find(".glb"), "click", () => keep(glb(this.#recording, this.#bodies), `${this.#file}.glb`));
    const [film, full] = [this.#find(".film"), this.#find(".full")];
    on(film, "click", () => (this.#finishFilm ? this.#finishFilm() : this.#film()));
    if (!filmType()) Object.assign(film, { disabled: true, title: NO_FILM });
    else if (!filmType().startsWith("video/mp4")) film.textContent = "WebM";
    on(full, "click", () =>
      document.fullscreenElement ? document.exitFullscreen() : this.#element.requestFullscreen(),
    );
    if (!document.fullscreenEnabled) Object.assign(full, { disabled: true, title: NO_FULL_SCREEN });
    on(this.#night, "change", () => {
      if (this.#recording) this.#dress();
      this.#draw();
    });
    listen(canvas, this, signal);
    on(canvas, "webglcontextlost", (event) => {
      event.preventDefault(); // otherwise the context could not be restored
      this.pause();
      this.#scene = null;
      this.#cover(LOST);
    });
    on(canvas, "webglcontextrestored", () => {
      this.#scene = Scene.on(canvas);
      if (this.#recording) this.#dress();
      this.#cover(LOST);
      this.#show(this.#frame);
    });
  }

  /** Give the scene the robots, with a dark floor if the page is dark. */
  #dress() {
    const isDark = this.#night.matches && getComputedStyle(this.#element).colorScheme.includes("dark");
    const style = { ...this.#recording.style, ...(isDark ? NIGHT : {}) };
    this.#scene?.load({ ...this.#recording, style }, this.#bodies);
    const stage = this.#find(".softvox-stage");
    stage.style.setProperty("--stage", cssOf(style.background));
    stage.style.setProperty("--stage-ink", cssOf(inkOn(style)));
  }

  get #names() {
    return this.#recording.robots.map((robot) => robot.label).join("; ");
  }

  /** Show a message and a still picture while there are no graphics; else remove them. */
  #cover(reason = this.#find(".softvox-message")?.textContent ?? NO_WEBGL) {
    this.#find(".softvox-lost")?.remove();
    this.#element.classList.toggle("softvox-still", !this.supported);
    if (this.supported) return;
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
    const words = time < settle ? "settling" : `cycle ${Math.floor(cycle + 1e-9) + 1}`;
    this.#find(".clock").textContent = `${time.toFixed(2)} s, ${words}`;
    this.#find(".frame").setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
    this.#strips?.show(frame);
    this.#element.dispatchEvent(new CustomEvent("frame", { detail: { frame, time, cycle } }));
  }

  #showPlaying() {
    this.#find(".play").textContent = this.playing ? "pause" : "play";
  }

  #draw() {
    if (!this.supported || !this.#recording) return;
    const panels = this.#scene.draw(this.#frame, this.#lap, this.view, this.#shown);
    const labels = this.#find(".softvox-labels");
    while (labels.children.length > panels.length) labels.lastChild.remove();
    while (labels.children.length < panels.length) labels.append(made("div", {}));
    panels.forEach((panel, i) => this.#write(labels.children[i], panel));
  }

  /** Write the texts of a panel: names, distances, the numbers of the ruler. */
  #write(label, { robots, marks, ...place }) {
    const isSmall = place.width < BESIDE_NAME + Math.max(...robots.map((i) => this.#widths[i]));
    const names = robots.map((i) => this.#recording.robots[i][isSmall ? "short_label" : "label"]);
    const gone = robots.map((i) => this.#bodies[i].gone(this.#frame).toFixed(2));
    const key = JSON.stringify([names, gone, marks, place]);
    if (label.key === key) return;
    label.key = key;
    for (const [name, value] of Object.entries(place)) label.style[name] = `${value}px`;
    label.classList.toggle("small", isSmall);
    const spans = names.map((textContent) => made("span", { className: "name", textContent }));
    if (this.#strips) spans.forEach((span, k) => (span.style.color = colourOf(robots[k], this.#bodies.length)));
    if (robots.length === 1 && !this.#filters) {
      spans.push(made("span", { className: "gone", textContent: gone[0] + (isSmall ? "" : " voxel widths") }));
    }
    const [width, height] = [place.width, place.height];
    const numbers = marks.map(({ text, robot, place: [x, y] }) => {
      const mark = made("span", { className: "mark", textContent: text });
      Object.assign(mark.style, { left: `${x * width}px`, top: `${y * height}px` });
      if (robot !== undefined) {
        mark.style.color = colourOf(robots[robot], this.#bodies.length);
        mark.style.transform = `translate(max(-100%, ${4 - x * width}px), -50%)`;
      }
      return mark;
    });
    label.replaceChildren(...spans, ...numbers);
  }

  get #texts() {
    return this.#element.querySelectorAll(".softvox-labels span");
  }

  /** The name of exported files. */
  get #file() {
    const names = this.#recording.robots.map(({ design, digits }) => design ?? digits);
    return `softvox-${[...new Set(names)].slice(0, 6).join("-")}`;
  }

  /** Film the recording from its start to its end, or until the button is pressed again. */
  async #film() {
    const [canvas, button] = [this.#find("canvas"), this.#find(".film")];
    const [type, word] = [filmType(), button.textContent];
    this.pause();
    this.seek(0);
    const film = composed(canvas, this.#texts);
    button.textContent = "stop";
    const frames = new AbortController();
    const content = await filmed(film, type, () => {
      return new Promise((resolve) => {
        this.#finishFilm = resolve;
        const take = ({ detail }) => {
          composed(canvas, this.#texts, film);
          if (detail.frame === this.frames - 1 || this.#lap > 0) resolve();
        };
        this.#element.addEventListener("frame", take, { signal: frames.signal });
        this.#lap = 0;
        this.play();
      });
    });
    frames.abort();
    this.pause();
    this.#finishFilm = null;
    button.textContent = word;
    keep(content, `${this.#file}.${type.slice(6).split(";")[0]}`);
  }

  /** Draw only some panels of a gallery. */
  #choose(shown) {
    this.#shown = shown;
    this.#fit();
  }

  /** Fit the drawing to the window's size, with room for each robot of a gallery. */
  #fit() {
    if (this.#shown) {
      const stage = this.#find(".softvox-stage");
      const across = Math.max(1, Math.floor(stage.clientWidth / CELL));
      stage.style.minHeight = `${Math.ceil(this.#shown.length / across) * CELL * 0.8}px`;
    }
    this.#draw();
  }

  #tellSunk() {
    const sunk = this.#filters ? 0 : Math.max(0, ...this.#bodies.map((body) => body.sunk()));
    this.#find(".softvox-sunk").hidden = sunk < DEEP;
    this.#find(".softvox-sunk p").textContent = `A corner is up to ${sunk.toFixed(2)} voxel widths
      under the floor. In the model a voxel touches the ground half an edge below its centre, however
      it is tilted, and the ground gives way a little; the floor hides what is below.`;
  }
}
