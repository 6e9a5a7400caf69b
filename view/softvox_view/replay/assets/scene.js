/**
 * Draws recordings of soft robots with WebGL 2: floor, shadow, trail and cubes, a panel per robot.
 *
 * Camera, light and colours are those of the still pictures (softvox_gym.rendering); the recording
 * brings them as `style`. Lengths are voxel widths, the floor is z = 0.
 */

import { boxOf, cameraOf } from "./camera.js";
import { CUBES, FLOOR, SHADOW, TRAIL } from "./shaders.js";

const SHADOW_LAYERS = 24; // shadows of one cube laid over each other, for a soft edge
const TRAIL_WIDTH = 3.5; // CSS pixels

/** The robots of a recording, in panels on a canvas. */
export class Scene {
  #gl;
  #programs = {};
  #style = null;
  #robots = [];
  #settled = 0; // the frame with which the trail begins

  /** Return a scene on a canvas; null where the browser has no WebGL 2 that works. */
  static on(canvas) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, stencil: true });
    try {
      return gl && !gl.isContextLost() ? new Scene(gl) : null;
    } catch (error) {
      console.warn(error); // the page shows a still picture, and somebody may want to know why
      return null;
    }
  }

  constructor(gl) {
    this.#gl = gl;
    const sources = { floor: FLOOR, cubes: CUBES, shadow: SHADOW, trail: TRAIL };
    for (const [name, parts] of Object.entries(sources)) this.#programs[name] = compiled(gl, parts);
  }

  /** Take the robots of a recording in. */
  load({ style, settle_time, seconds_per_frame, frames, robots }) {
    this.#forget();
    const [x_axis, y_axis] = style.axis_colours;
    // GLSL has its own words floor and active.
    this.#style = { ...style, x_axis, y_axis, floor_colour: style.floor, active_colour: style.active };
    this.#settled = Math.min(Math.round(settle_time / seconds_per_frame), frames - 1);
    this.#robots = robots.map(({ position, quaternion, edge, active, centre, scale, distance }) => {
      const path = new Float32Array(bytes(centre).buffer);
      const moving = [position, quaternion, edge].map(bytes);
      const buffers = [...moving, Uint8Array.from(active), path].map((array) => this.#buffer(array));
      return { voxels: active.length, scale, distance, path, box: boxOf(path), buffers };
    });
  }

  /**
   * Draw a frame.
   *
   * @returns {{left: number, top: number, width: number, height: number}[]} Each robot's panel in
   *   CSS pixels.
   */
  draw(frame, view) {
    const gl = this.#gl;
    const { canvas } = gl;
    const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
    for (const [side, shown] of [["width", canvas.clientWidth], ["height", canvas.clientHeight]]) {
      const pixels = Math.max(1, Math.round(shown * ratio));
      if (canvas[side] !== pixels) canvas[side] = pixels;
    }
    const panels = arranged(this.#robots.length, canvas.width, canvas.height);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(...this.#style.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT); // there may be more places than robots
    gl.enable(gl.SCISSOR_TEST);
    panels.forEach((panel, i) => {
      const box = [panel.left, canvas.height - panel.top - panel.height, panel.width, panel.height];
      gl.viewport(...box);
      gl.scissor(...box);
      gl.clear(gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      this.#drawRobot(this.#robots[i], frame, view, panel, ratio);
    });
    return panels.map((panel) =>
      Object.fromEntries(Object.entries(panel).map(([name, value]) => [name, value / ratio])),
    );
  }

  /** Give the graphics memory back. */
  destroy() {
    this.#forget();
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #forget() {
    for (const buffer of this.#robots.flatMap((robot) => robot.buffers)) this.#gl.deleteBuffer(buffer);
    this.#robots = [];
  }

  #buffer(array) {
    const gl = this.#gl;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    return buffer;
  }

  #drawRobot(robot, frame, view, panel, ratio) {
    const gl = this.#gl;
    const style = this.#style;
    const camera = cameraOf(style, robot, frame, view, panel);
    const values = {
      ...style,
      ...camera,
      scale: robot.scale,
      fade: style.fade * camera.distance,
      line: Math.max(style.line * camera.pixels_per_width, style.thinnest_line * ratio),
      pixels: [panel.width, panel.height],
      trail_width: TRAIL_WIDTH * ratio,
    };
    this.#take();
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
    this.#use("floor", values);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (!robot.voxels) return;

    const [position, quaternion, edge, active, path] = robot.buffers;
    const first = 2 * frame * robot.voxels;
    const voxels = [
      [position, 3, gl.SHORT, 3 * first],
      [quaternion, 4, gl.SHORT, 4 * first],
      [edge, 1, gl.SHORT, first],
      [active, 1, gl.UNSIGNED_BYTE, 0],
    ];
    this.#take(...voxels);
    this.#drawShadow(robot, values);
    const segments = frame - this.#settled;
    if (segments > 0) {
      const ends = [this.#settled, this.#settled + 1];
      this.#take(...ends.map((end) => [path, 2, gl.FLOAT, 12 * end, 12]));
      this.#use("trail", values);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, segments);
      this.#take(...voxels);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    this.#use("cubes", values);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, robot.voxels);
  }

  /** Darken each pixel at most once per layer: the stencil holds the last layer that did. */
  #drawShadow(robot, values) {
    const gl = this.#gl;
    const darkening = 1 - (1 - values.shadow) ** (1 / SHADOW_LAYERS);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    for (let i = 0; i < SHADOW_LAYERS; i++) {
      // A sunflower's spiral spreads the layers evenly over a disc.
      const radius = 2 * values.penumbra * Math.sqrt((i + 0.5) / SHADOW_LAYERS);
      const shift = [radius * Math.cos(2.39996 * i), radius * Math.sin(2.39996 * i)];
      this.#use("shadow", { ...values, shift, darkening });
      gl.stencilFunc(gl.NOTEQUAL, i + 1, 0xff);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, robot.voxels);
    }
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
  }

  /** Let the shaders read from buffers: numbers of a size and type, those of whole type up to 1. */
  #take(...sources) {
    const gl = this.#gl;
    for (let i = 0; i < 4; i++) gl.disableVertexAttribArray(i);
    sources.forEach(([buffer, size, type, offset, stride = 0], i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, type, type === gl.SHORT, stride, offset);
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

/** Return panels of equal size, in the number of columns that makes the shorter side largest. */
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

const bytes = (base64) => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
