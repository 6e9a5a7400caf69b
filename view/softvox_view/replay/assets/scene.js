/**
 * Draws recordings of soft robots with WebGL 2, a panel per robot or scene: floor, ghosts, ruler,
 * shadows, paths and bodies.
 *
 * Camera, light and colours are those of the still pictures (softvox_gym.rendering); the recording
 * has them as `style`. Lengths are voxel widths, the floor is z = 0.
 */

import { NUMBERS_PER_FACE } from "./bodies.js";
import { cameraOf, onPanel, Route } from "./camera.js";
import { CUBES, FLOOR, SHADOW, STROKE } from "./shaders.js";

const SHADOW_LAYERS = 24; // copies of a robot's shadow, offset for a soft edge
const FEW_LAYERS = 8; // in panels lower than this, CSS pixels
const LOW = 160;

/** Return the colour of words and the ruler: that of lines, or a light one on a dark background. */
export function inkOn({ background, ink }) {
  return background[1] > 0.5 ? ink : [0.9, 0.92, 0.94];
}

/** The robots of a recording, in panels on a canvas. */
export class Scene {
  #gl;
  #programs = {};
  #style = null;
  #panels = [];
  #buffers = [];
  #moving; // the faces being drawn

  /** Return a scene on a canvas; null if the browser has no working WebGL 2. */
  static on(canvas) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, stencil: true });
    try {
      return gl && !gl.isContextLost() ? new Scene(gl) : null;
    } catch (error) {
      console.warn(error); // the page shows a still picture; the console says why
      return null;
    }
  }

  constructor(gl) {
    this.#gl = gl;
    const sources = { floor: FLOOR, cubes: CUBES, shadow: SHADOW, stroke: STROKE };
    for (const [name, parts] of Object.entries(sources)) this.#programs[name] = compiled(gl, parts);
  }

  /** Load the robots of a recording. */
  load({ style, robots }, bodies) {
    this.#forget();
    const [x_axis, y_axis] = style.axis_colours;
    // floor and active are reserved words in GLSL.
    this.#style = { ...style, x_axis, y_axis, floor_colour: style.floor, active_colour: style.active };
    this.#moving = this.#buffer(new Float32Array());
    const groups = [];
    robots.forEach(({ panel }, i) => (groups[panel ?? i] ??= []).push(i));
    this.#panels = groups.map((numbers) => {
      const those = numbers.map((i) => bodies[i]);
      const route = new Route(style, those);
      const signs = numbers.map((i) => robots[i].world ?? null);
      const ruler = this.#buffer(new Float32Array(route.lines().flat()));
      const paths = those.map((body) => this.#buffer(body.path));
      return { bodies: those, numbers, route, signs, ruler, paths, loops: robots[numbers[0]].loops };
    });
  }

  /**
   * Draw a frame of a recording that was shown `lap` times before, in the chosen panels, or all if null.
   *
   * @returns {{left: number, top: number, width: number, height: number, marks: object[]}[]} Each
   *   panel in CSS pixels, and the texts in it: the numbers of the ruler, and the worlds' names.
   */
  draw(frame, lap, view, chosen = null) {
    const gl = this.#gl;
    const { canvas } = gl;
    const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
    for (const [side, shown] of [["width", canvas.clientWidth], ["height", canvas.clientHeight]]) {
      const pixels = Math.max(1, Math.round(shown * ratio));
      if (canvas[side] !== pixels) canvas[side] = pixels;
    }
    const shown = chosen ?? this.#panels.map((_, i) => i);
    const places = arranged(shown.length, canvas.width, canvas.height);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(...this.#style.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT); // there may be more places than robots
    gl.enable(gl.SCISSOR_TEST);
    return places.map((place, i) => {
      const box = [place.left, canvas.height - place.top - place.height, place.width, place.height];
      gl.viewport(...box);
      gl.scissor(...box);
      gl.clear(gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      const marks = this.#drawPanel(this.#panels[shown[i]], frame, lap, view, place, ratio);
      const inCss = Object.fromEntries(Object.entries(place).map(([name, value]) => [name, value / ratio]));
      return { ...inCss, robots: this.#panels[shown[i]].numbers, marks };
    });
  }

  /** Free the graphics memory. */
  destroy() {
    this.#forget();
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #forget() {
    for (const buffer of this.#buffers) this.#gl.deleteBuffer(buffer);
    this.#buffers = [];
    this.#panels = [];
  }

  #buffer(array) {
    const gl = this.#gl;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    this.#buffers.push(buffer);
    return buffer;
  }

  #drawPanel(panel, frame, lap, view, place, ratio) {
    const gl = this.#gl;
    const style = this.#style;
    const { route } = panel;
    const bodies = panel.bodies.filter((body) => body.voxels);
    const drift = (body) => body.centre(body.frames - 1).map((value, k) => lap * (value - body.centre(body.begin)[k]));
    const moved = panel.loops ? bodies.map(drift) : bodies.map(() => [0, 0, 0]);
    const now = bodies.map((body, i) => body.centre(frame).map((value, k) => value + moved[i][k]));
    const camera = cameraOf(style, route, now.length ? now : [[...route.origin, 0]], view, place);
    const values = {
      ...{ ...style, ...camera, light: route.light, opacity: 1 },
      fade: style.fade * camera.distance,
      line: Math.max(style.line * camera.pixels_per_width, style.thinnest_line * ratio),
      pixels: [place.width, place.height],
    };
    this.#take();
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
    this.#use("floor", values);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (!bodies.length) return [];

    const facesAt = (at, by) =>
      bodies.flatMap((body, i) => body.faces(at(body), !view.boxes, camera.anchor.map((value, k) => value - by[i][k])));
    if (!panel.loops) {
      this.#drawGhosts(facesAt((body) => body.begin, moved), values);
      this.#drawRuler(panel, frame, values, (style.trail_width * place.height) / 360);
    }
    const count = this.#send(facesAt(() => frame, moved));
    this.#drawShadow(count, values, place.height < LOW * ratio ? FEW_LAYERS : SHADOW_LAYERS);
    if (!panel.loops) this.#drawPaths(panel, frame, values, (style.trail_width * place.height) / 360);
    this.#drawFaces(this.#send(null, count), values);
    return panel.loops ? [] : marksOf(panel, camera, style);
  }

  /** Upload faces to draw; for faces uploaded before, only their number is needed. Return it. */
  #send(faces, count = faces.length / NUMBERS_PER_FACE) {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#moving);
    if (faces) gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(faces), gl.DYNAMIC_DRAW);
    const stride = 4 * NUMBERS_PER_FACE;
    const corners = [0, 1, 2, 3].map((k) => [this.#moving, 3, 12 * k, stride]);
    this.#take(...corners, [this.#moving, 1, 48, stride]);
    return count;
  }

  #drawFaces(count, values) {
    const gl = this.#gl;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    this.#use("cubes", values);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, count);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
  }

  /** Draw the robots at their start, pale: first only their depth, so that only the nearest faces show. */
  #drawGhosts(faces, values) {
    const gl = this.#gl;
    const count = this.#send(faces);
    gl.colorMask(false, false, false, false);
    this.#drawFaces(count, values);
    gl.colorMask(true, true, true, true);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.#drawFaces(count, { ...values, opacity: values.ghost });
    gl.disable(gl.BLEND);
    gl.clear(gl.DEPTH_BUFFER_BIT);
  }

  #drawRuler({ ruler, route }, frame, values, width) {
    const gl = this.#gl;
    const strokes = [[0, 1, width / 2], [16, route.high - route.low + 1, width / 4]];
    for (const [offset, count, stroke_width] of strokes) {
      this.#take(...[0, 8].map((end) => [ruler, 2, offset + end, 16]));
      this.#use("stroke", { ...values, stroke: inkOn(values), stroke_width });
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    }
  }

  /** Draw the paths so far, and the first robot's distance along the ruler. */
  #drawPaths({ bodies, paths, route }, frame, values, stroke_width) {
    const gl = this.#gl;
    this.#use("stroke", { ...values, stroke: values.trail, stroke_width });
    bodies.forEach((body, i) => {
      const segments = frame - body.begin;
      if (segments <= 0 || !body.voxels) return;
      this.#take(...[0, 1].map((end) => [paths[i], 2, 12 * (body.begin + end), 12]));
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, segments);
    });
    this.#take();
    if (frame <= bodies[0].begin) return;
    gl.vertexAttrib2f(0, ...route.point(0));
    gl.vertexAttrib2f(1, ...route.point(route.along(bodies[0].centre(frame))));
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /** Darken each pixel at most once per layer: the stencil holds the last layer that did. */
  #drawShadow(count, values, layers) {
    const gl = this.#gl;
    const darkening = 1 - (1 - values.shadow) ** (1 / layers);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    for (let i = 0; i < layers; i++) {
      // A sunflower's spiral spreads the layers evenly over a disc.
      const radius = 2 * values.penumbra * Math.sqrt((i + 0.5) / layers);
      const shift = [radius * Math.cos(2.39996 * i), radius * Math.sin(2.39996 * i)];
      this.#use("shadow", { ...values, shift, darkening });
      gl.stencilFunc(gl.NOTEQUAL, i + 1, 0xff);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, count);
    }
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
  }

  /** Bind buffers to the shaders' inputs: numbers per item, offset and stride. */
  #take(...sources) {
    const gl = this.#gl;
    for (let i = 0; i < 5; i++) gl.disableVertexAttribArray(i);
    sources.forEach(([buffer, size, offset, stride], i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, gl.FLOAT, false, stride, offset);
      gl.vertexAttribDivisor(i, 1);
    });
  }

  #use(name, values) {
    const gl = this.#gl;
    gl.useProgram(this.#programs[name].program);
    for (const [uniform, place] of this.#programs[name].places) {
      const value = values[uniform];
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 2) gl.uniform2fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else gl.uniformMatrix4fv(place, false, value);
    }
  }
}

/** Return the texts of a panel and their positions, 0 to 1; a world's name ends at its position. */
function marksOf({ bodies, route, signs }, camera, { sign }) {
  const numbers = route.numbers().filter((s) => s % route.step === 0);
  const ofRuler = numbers.map((s) => ({ text: String(s), point: route.point(s, 3.7 * route.tick) }));
  const ofWorlds = bodies.map((body, robot) => {
    const [x, y, z] = body.centre(body.begin);
    const back = sign * route.alone;
    return { text: signs[robot], robot, point: [x - back * route.ahead[0], y - back * route.ahead[1], z] };
  });
  const marks = [...ofRuler, ...ofWorlds.filter(({ text }) => text)];
  return marks.flatMap(({ text, robot, point }) => {
    const [x, y] = onPanel(camera, point) ?? [NaN];
    const isSeen = (x > 0 || robot !== undefined) && x < 1 && y > 0 && y < 1;
    return isSeen ? [{ text, robot, place: [x, y] }] : [];
  });
}

/** Return panels of equal size, in as many columns as make their shorter side largest. */
function arranged(count, width, height) {
  const side = (n) => Math.min(width / n, height / Math.ceil(count / n));
  let columns = 1;
  for (let n = 2; n <= count; n++) if (side(n) > side(columns)) columns = n;
  const size = { width: Math.floor(width / columns), height: Math.floor(height / Math.ceil(count / columns)) };
  return Array.from({ length: count }, (_, i) => {
    return { left: (i % columns) * size.width, top: Math.floor(i / columns) * size.height, ...size };
  });
}

function compiled(gl, sources) {
  const program = gl.createProgram();
  const shaders = sources.map((source, i) => {
    const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${source}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    return shader;
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = shaders.map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`a shader does not compile: ${logs.join(" ")}${gl.getProgramInfoLog(program)}`);
  }
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
  const names = Array.from({ length: count }, (_, i) => gl.getActiveUniform(program, i).name);
  return { program, places: names.map((name) => [name, gl.getUniformLocation(program, name)]) };
}
