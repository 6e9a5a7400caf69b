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
  #canvas;
  #programs;
  #style = null;
  #robots = [];
  #settled = 0; // the frame with which the trail begins

  /** Return a scene on a canvas; null where the browser has no WebGL 2 that works. */
  static on(canvas) {
    const options = { alpha: false, antialias: true, stencil: true };
    const gl = canvas.getContext("webgl2", options);
    if (!gl || gl.isContextLost()) return null;
    try {
      return new Scene(canvas, gl);
    } catch (error) {
      console.warn(error); // the page shows a still picture, and somebody may want to know why
      return null;
    }
  }

  constructor(canvas, gl) {
    this.#canvas = canvas;
    this.#gl = gl;
    const sources = { floor: FLOOR, cubes: CUBES, shadow: SHADOW, trail: TRAIL };
    this.#programs = Object.fromEntries(
      Object.entries(sources).map(([name, parts]) => [name, compiled(gl, ...parts)]),
    );
  }

  /** Take the robots of a recording in. */
  load(recording) {
    this.#forget();
    this.#style = recording.style;
    const settled = Math.round(recording.settle_time / recording.seconds_per_frame);
    this.#settled = Math.min(settled, recording.frames - 1);
    this.#robots = recording.robots.map((robot) => this.#uploaded(robot));
  }

  /**
   * Draw a frame.
   *
   * @returns {{left: number, top: number, width: number, height: number}[]} Each robot's panel in
   *   CSS pixels.
   */
  draw(frame, view) {
    const gl = this.#gl;
    const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
    const { clientWidth, clientHeight } = this.#canvas;
    const [width, height] = [clientWidth, clientHeight].map((side) =>
      Math.max(1, Math.round(side * ratio)),
    );
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
    const panels = arranged(this.#robots.length, width, height);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(...this.#style.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT); // there may be more places than robots
    gl.enable(gl.SCISSOR_TEST);
    panels.forEach((panel, i) => {
      const bottom = height - panel.top - panel.height;
      gl.viewport(panel.left, bottom, panel.width, panel.height);
      gl.scissor(panel.left, bottom, panel.width, panel.height);
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
    for (const robot of this.#robots) {
      for (const buffer of robot.buffers) this.#gl.deleteBuffer(buffer);
    }
    this.#robots = [];
  }

  #uploaded(robot) {
    const voxels = robot.active.length;
    const values = {
      position: numbers(robot.position),
      quaternion: numbers(robot.quaternion),
      edge: numbers(robot.edge),
      active: Float32Array.from(robot.active),
    };
    const middles = floats(robot.centre);
    values.position.forEach((_, i) => {
      values.position[i] += middles[3 * Math.floor(i / (3 * voxels)) + (i % 3)];
    });
    const centres = middles.filter((_, i) => i % 3 < 2);
    const buffers = [...Object.values(values), centres].map((array) => this.#buffer(array));
    return { voxels, centres, buffers, box: boxOf(centres), distance: robot.distance };
  }

  #buffer(array) {
    const gl = this.#gl;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    return buffer;
  }

  #drawRobot(robot, frame, view, panel, ratio) {
    const camera = cameraOf(this.#style, robot, frame, view, panel);
    this.#drawFloor(camera);
    if (!robot.voxels) return;
    this.#takeVoxels(robot, frame);
    this.#drawShadow(robot, camera);
    this.#drawTrail(robot, frame, camera, panel, ratio);
    this.#takeVoxels(robot, frame);
    this.#drawCubes(robot, camera, ratio);
  }

  /** Let the shaders read position, quaternion and edge in a frame, and which voxels are active. */
  #takeVoxels(robot, frame) {
    [3, 4, 1].forEach((size, i) => {
      this.#attribute(i, robot.buffers[i], size, 4 * size * frame * robot.voxels);
    });
    this.#attribute(3, robot.buffers[3], 1, 0);
  }

  #attribute(location, buffer, size, offset, stride = 0) {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, gl.FLOAT, false, stride, offset);
    gl.vertexAttribDivisor(location, 1);
  }

  #drawFloor(camera) {
    const gl = this.#gl;
    const style = this.#style;
    const { anchor, eye, forward, right, up, target } = camera;
    this.#use("floor", {
      ...{ anchor, eye, forward, right, up, target },
      fade: style.fade * camera.distance,
      grid_line: style.grid_line,
      grid_strength: style.grid_strength,
      axis_line: style.axis_line,
      axis_strength: style.axis_strength,
      background: style.background,
      floor_colour: style.floor,
      ink: style.ink,
      x_axis: style.axis_colours[0],
      y_axis: style.axis_colours[1],
    });
    for (let i = 0; i < 4; i++) gl.disableVertexAttribArray(i);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Darken each pixel at most once per layer: the stencil holds the last layer that did. */
  #drawShadow(robot, camera) {
    const gl = this.#gl;
    const { shadow, penumbra, light } = this.#style;
    const darkening = 1 - (1 - shadow) ** (1 / SHADOW_LAYERS);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    for (let i = 0; i < SHADOW_LAYERS; i++) {
      // A sunflower's spiral spreads the layers evenly over a disc.
      const radius = 2 * penumbra * Math.sqrt((i + 0.5) / SHADOW_LAYERS);
      const shift = [radius * Math.cos(2.39996 * i), radius * Math.sin(2.39996 * i)];
      const { matrix, anchor } = camera;
      this.#use("shadow", { camera: matrix, anchor, light, shift, darkening });
      gl.stencilFunc(gl.NOTEQUAL, i + 1, 0xff);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, robot.voxels);
    }
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);
  }

  #drawTrail(robot, frame, camera, panel, ratio) {
    const segments = frame - this.#settled;
    if (segments < 1) return;
    for (const [location, first] of [
      [0, this.#settled],
      [1, this.#settled + 1],
    ]) {
      this.#attribute(location, robot.buffers[4], 2, 8 * first);
    }
    for (const location of [2, 3]) this.#gl.disableVertexAttribArray(location);
    this.#use("trail", {
      camera: camera.matrix,
      anchor: camera.anchor,
      pixels: [panel.width, panel.height],
      width: TRAIL_WIDTH * ratio,
      tint: this.#style.trail,
    });
    this.#gl.drawArraysInstanced(this.#gl.TRIANGLE_STRIP, 0, 4, segments);
  }

  #drawCubes(robot, camera, ratio) {
    const gl = this.#gl;
    const { light, passive, active, darkest, ink, line, thinnest_line } = this.#style;
    this.#use("cubes", {
      ...{ light, passive, darkest, ink },
      camera: camera.matrix,
      anchor: camera.anchor,
      active_colour: active,
      line: Math.max(line * camera.scale, thinnest_line * ratio),
    });
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, robot.voxels);
  }

  #use(name, values) {
    const gl = this.#gl;
    const { program, places } = this.#programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries(values)) {
      const place = places[key];
      if (place === undefined) continue;
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 2) gl.uniform2fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else gl.uniformMatrix4fv(place, false, value);
    }
  }
}

/** Return panels of equal size, in the number of columns that makes the shorter side largest. */
function arranged(count, width, height) {
  let best = { columns: 1, side: 0 };
  for (let columns = 1; columns <= count; columns++) {
    const side = Math.min(width / columns, height / Math.ceil(count / columns));
    if (side > best.side) best = { columns, side };
  }
  const [columns, rows] = [best.columns, Math.ceil(count / best.columns)];
  const split = (side, i, n) => [Math.round((side * i) / n), Math.round((side * (i + 1)) / n)];
  return Array.from({ length: count }, (_, i) => {
    const [left, right] = split(width, i % columns, columns);
    const [top, bottom] = split(height, Math.floor(i / columns), rows);
    return { left, top, width: right - left, height: bottom - top };
  });
}

function compiled(gl, ...sources) {
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
    const logs = [...shaders.map((shader) => gl.getShaderInfoLog(shader))];
    throw new Error(`a shader does not compile: ${logs.join(" ")}${gl.getProgramInfoLog(program)}`);
  }
  const places = {};
  for (let i = 0; i < (gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0); i++) {
    const { name } = gl.getActiveUniform(program, i);
    places[name] = gl.getUniformLocation(program, name);
  }
  return { program, places };
}

/** Return the numbers that a recording holds as 16-bit counts, base64 and little-endian. */
function numbers({ data, offset, scale }) {
  const text = atob(data);
  const size = offset.length;
  const values = new Float32Array(text.length / 2);
  for (let i = 0; i < values.length; i++) {
    const count = text.charCodeAt(2 * i) + 256 * text.charCodeAt(2 * i + 1);
    values[i] = offset[i % size] + scale[i % size] * count;
  }
  return values;
}

/** Return the numbers that a recording holds as 32-bit floats, base64 and little-endian. */
function floats(data) {
  const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float32Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
}
