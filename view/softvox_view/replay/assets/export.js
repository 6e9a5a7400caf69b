/** What is seen as files: pictures, films, and glTF for other programs (Khronos Group, glTF 2.0, 2021). */

import { CUBE_CORNERS, CUBE_FACES } from "./bodies.js";

const FILM_TYPES = ["video/mp4;codecs=avc1.42E01F", "video/mp4", "video/webm;codecs=vp9", "video/webm"];
const APART = 5; // voxel widths between robots that have no place of their own
const [GL_FLOAT, GL_UINT16] = [5126, 5123];

/** The kind of film that this browser makes of a canvas, as a MIME type; null where it makes none. */
export function filmType() {
  if (!globalThis.MediaRecorder || !HTMLCanvasElement.prototype.captureStream) return null;
  return FILM_TYPES.find((type) => MediaRecorder.isTypeSupported(type)) ?? null;
}

/** Draw a canvas, and the texts that lie over it, onto another of its size. */
export function composed(canvas, texts, onto = document.createElement("canvas")) {
  Object.assign(onto, { width: canvas.width - (canvas.width % 2), height: canvas.height - (canvas.height % 2) });
  const context = onto.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const whole = canvas.getBoundingClientRect();
  context.scale(canvas.width / whole.width, canvas.height / whole.height);
  context.textBaseline = "middle";
  for (const text of texts) {
    const { left, top, height } = text.getBoundingClientRect();
    const { font, color } = getComputedStyle(text);
    Object.assign(context, { font, fillStyle: color });
    context.fillText(text.textContent, left - whole.left, top - whole.top + height / 2);
  }
  return onto;
}

/** Save a Blob, or anything that one can be made of, as a file. */
export function keep(content, name) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content]));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** Film a canvas until the promise that `play` returns is done; the promise of a Blob. */
export async function filmed(canvas, type, play) {
  const recorder = new MediaRecorder(canvas.captureStream(), { mimeType: type, videoBitsPerSecond: 6e6 });
  const parts = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  const done = new Promise((resolve) => (recorder.onstop = resolve));
  recorder.start();
  await play();
  recorder.stop();
  await done;
  return new Blob(parts, { type: type.split(";")[0] });
}

/** Return a recording's robots as the bytes of a .glb, as softvox_view.replay.glb does. */
export function glb({ robots, style, physics, frames, seconds_per_frame }, bodies) {
  const [parts, views, accessors] = [[], [], []];
  let size = 0;
  const accessor = (array, type, more = {}) => {
    const count = array.length / { SCALAR: 1, VEC3: 3, VEC4: 4 }[type];
    views.push({ buffer: 0, byteOffset: size, byteLength: array.byteLength });
    const componentType = array instanceof Float32Array ? GL_FLOAT : GL_UINT16;
    accessors.push({ bufferView: accessors.length, componentType, count, type, ...more });
    parts.push(new Uint8Array(array.buffer));
    size += array.byteLength;
    return accessors.length - 1;
  };
  const normal = (face) => [0, 1, 2].map((axis) => face.reduce((sum, c) => sum + CUBE_CORNERS[c][axis] / 4, 0));
  const corners = CUBE_FACES.flatMap((face) => face.flatMap((c) => CUBE_CORNERS[c].map((value) => value / 2)));
  const normals = CUBE_FACES.flatMap((face) => face.flatMap(() => normal(face)));
  const triangles = CUBE_FACES.flatMap((_, k) => [0, 1, 2, 0, 2, 3].map((c) => 4 * k + c));
  const box = { min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5] };
  const POSITION = accessor(new Float32Array(corners), "VEC3", box);
  const cube = { POSITION, NORMAL: accessor(new Float32Array(normals), "VEC3") };
  const indices = accessor(new Uint16Array(triangles), "SCALAR");
  const time = Float32Array.from({ length: frames }, (_, frame) => frame * seconds_per_frame);
  const clock = accessor(time, "SCALAR", { min: [time[0]], max: [time[frames - 1]] });

  const upright = [-Math.SQRT1_2, 0, 0, Math.SQRT1_2];
  const nodes = [{ rotation: upright, scale: [physics.edge, physics.edge, physics.edge], children: [] }];
  const [samplers, channels] = [[], []];
  const along = (of) => Float32Array.from(Array.from({ length: frames }, (_, frame) => of(frame)).flat());
  robots.forEach((robot, k) => {
    const [x, y] = robot.shift ?? [0, 0];
    nodes[0].children.push(nodes.length);
    const parent = { name: robot.label, translation: [x, y + APART * (robot.panel ?? k), 0] };
    nodes.push(robot.active.length ? Object.assign(parent, { children: [] }) : parent);
    robot.active.forEach((kind, v) => {
      const body = bodies[k];
      const moving = {
        translation: along((frame) => body.position(frame, v).map((value, axis) => value - [x, y, 0][axis])),
        rotation: along((frame) => [1, 2, 3, 0].map((part) => body.quaternion(frame, v)[part])),
        scale: along((frame) => Array(3).fill(body.edge(frame, v))),
      };
      parent.children.push(nodes.length);
      for (const [path, values] of Object.entries(moving)) {
        channels.push({ sampler: samplers.length, target: { node: nodes.length, path } });
        samplers.push({ input: clock, output: accessor(values, path === "rotation" ? "VEC4" : "VEC3") });
      }
      nodes.push({ mesh: kind });
    });
  });
  const material = (colour) => {
    const linear = colour.map((value) => Math.round(value ** 2.2 * 1e4) / 1e4); // as colours are there
    const shine = { metallicFactor: 0, roughnessFactor: 0.9 };
    return { pbrMetallicRoughness: { baseColorFactor: [...linear, 1], ...shine } };
  };
  const meshes = [0, 1].map((kind) => ({ primitives: [{ attributes: cube, indices, material: kind }] }));
  const scene = { asset: { version: "2.0", generator: "softvox-gym" }, scene: 0, scenes: [{ nodes: [0] }], nodes, meshes };
  Object.assign(scene, { materials: [style.passive, style.active].map(material), accessors });
  Object.assign(scene, { bufferViews: views, buffers: [{ byteLength: size }] });
  if (channels.length) scene.animations = [{ name: "walk", channels, samplers }];
  const text = new TextEncoder().encode(JSON.stringify(scene));
  const padding = new Uint8Array((4 - (text.length % 4)) % 4).fill(32);
  const numbers = (...values) => new Uint8Array(new Uint32Array(values).buffer);
  const [length, whole] = [text.length + padding.length, 28 + text.length + padding.length + size];
  const head = [numbers(0x46546c67, 2, whole, length, 0x4e4f534a), text, padding];
  return new Blob([...head, numbers(size, 0x4e4942), ...parts], { type: "model/gltf-binary" });
}
