/** Exports of the view: pictures, films, and glTF for other programs (Khronos Group, glTF 2.0, 2021). */

import { CUBE_CORNERS, CUBE_FACES } from "./bodies.js";

const FILM_TYPES = ["video/mp4;codecs=avc1.42E01F", "video/mp4", "video/webm;codecs=vp9", "video/webm"];
const APART = 5; // voxel widths between robots without positions of their own

/** The kind of film that this browser can record of a canvas, as a MIME type; null if none. */
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
  const halo = getComputedStyle(canvas.parentElement).getPropertyValue("--stage");
  for (const text of texts) {
    const { left, top, height } = text.getBoundingClientRect();
    const { font, color } = getComputedStyle(text);
    const words = [text.textContent, left - whole.left, top - whole.top + height / 2];
    Object.assign(context, { font, fillStyle: color, strokeStyle: halo, lineWidth: 3, lineJoin: "round" });
    context.strokeText(...words);
    context.fillText(...words);
  }
  return onto;
}

/** Save a Blob, or its content, as a file. */
export function keep(content, name) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content]));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** Film a canvas until the promise that `play` returns settles; returns the promise of a Blob. */
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

/** Return a recording's robots as a .glb, as softvox_view.replay.gltf does, which describes it. */
export function glb({ robots, style, physics, frames, seconds_per_frame }, bodies) {
  const every = (of) => Float32Array.from(Array.from({ length: frames }, (_, frame) => of(frame)).flat());
  const corners = Float32Array.from(CUBE_CORNERS.flat(), (value) => value / 2);
  const triangles = CUBE_FACES.flatMap((face) => [0, 1, 2, 0, 2, 3].map((c) => face[c]));
  const time = every((frame) => frame * seconds_per_frame);
  const arrays = [[corners, 3], [new Uint16Array(triangles), 1], [time, 1]];
  const nodes = [{ rotation: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2], scale: Array(3).fill(physics.edge) }];
  const channels = [];
  bodies.forEach((body, k) => {
    const aside = [0, APART * (robots[k].panel ?? k), 0];
    body.active.forEach((mesh, v) => {
      const moving = {
        translation: every((frame) => body.position(frame, v).map((value, axis) => value + aside[axis])),
        rotation: every((frame) => [1, 2, 3, 0].map((part) => body.quaternion(frame, v)[part])),
        scale: every((frame) => Array(3).fill(body.edge(frame, v))),
      };
      for (const [path, values] of Object.entries(moving)) {
        channels.push({ sampler: channels.length, target: { node: nodes.length, path } });
        arrays.push([values, path === "rotation" ? 4 : 3]);
      }
      nodes.push({ name: `${robots[k].label} · ${v}`, mesh });
    });
  });
  if (nodes.length > 1) nodes[0].children = nodes.map((_, k) => k).slice(1);
  let size = 0;
  const bufferViews = arrays.map(([{ byteLength }]) => ({ buffer: 0, byteOffset: (size += byteLength) - byteLength, byteLength }));
  const accessors = arrays.map(([array, width], bufferView) => ({
    bufferView,
    componentType: array instanceof Uint16Array ? 5123 : 5126, // OpenGL's codes for uint16 and float
    count: array.length / width,
    type: { 1: "SCALAR", 3: "VEC3", 4: "VEC4" }[width],
  }));
  // glTF requires the bounds of these.
  Object.assign(accessors[0], { min: Array(3).fill(-0.5), max: Array(3).fill(0.5) });
  Object.assign(accessors[2], { min: [0], max: [time.at(-1)] });
  const linear = (colour) => [...colour.map((value) => Math.round(value ** 2.2 * 1e4) / 1e4), 1];
  const scene = {
    asset: { version: "2.0", generator: "softvox-gym" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes,
    meshes: [0, 1].map((k) => ({ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: k }] })),
    materials: [style.passive, style.active].map((colour) => ({
      pbrMetallicRoughness: { baseColorFactor: linear(colour), metallicFactor: 0 },
    })),
    ...{ accessors, bufferViews, buffers: [{ byteLength: size }] },
  };
  const samplers = channels.map((_, k) => ({ input: 2, output: k + 3 }));
  if (channels.length) scene.animations = [{ name: "walk", channels, samplers }];
  const text = new TextEncoder().encode(JSON.stringify(scene));
  const padding = new Uint8Array((4 - (text.length % 4)) % 4).fill(32);
  const length = text.length + padding.length;
  const numbers = (...values) => new Uint32Array(values);
  const parts = [numbers(0x46546c67, 2, 28 + length + size, length, 0x4e4f534a), text, padding];
  return new Blob([...parts, numbers(size, 0x4e4942), ...arrays.map(([array]) => array)], { type: "model/gltf-binary" });
}
