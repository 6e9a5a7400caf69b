// Recordings for the player, in the format of softvox_view.replay.data, which describes it.

import { digitsOfAll, displacementsOf, SITES, timeStep } from "./physics.js";

const STEPS = 2 ** 15 - 1; // the count that stands for 1
const HALF_WAY = 1.5 * 2 ** 52; // adding and subtracting it rounds to a whole number, ties to even

/** Return the recording of designs that `simulateOn` simulated with so many steps between frames. */
export function recordingOf({ facts, frames, count }, physics, designs, every, style) {
  const step = timeStep(physics);
  const moved = displacementsOf(facts, physics, designs);
  const seconds = (count - 1) * every * step;
  const poses = frames.length / designs.length;
  return {
    format: "softvox-replay",
    version: 2,
    frames: count,
    seconds_per_frame: every * step,
    settle_time: physics.settle_time,
    frequency_hz: physics.frequency_hz,
    cycles: (seconds - physics.settle_time) * physics.frequency_hz,
    physics,
    style,
    robots: designs.map((design, i) =>
      robotOf(design, frames.subarray(i * poses, (i + 1) * poses), moved.subarray(3 * i), count, physics, style),
    ),
  };
}

function robotOf(design, poses, [dx, dy], count, physics, style) {
  const digits = [...digitsOfAll([design])];
  const voxels = SITES.map((_, i) => i).filter((i) => digits[i]);
  const pose = (frame, voxel) => poses.subarray(8 * (8 * frame + voxel), 8 * (8 * frame + voxel) + 8);
  const isThere = (frame) => voxels.every((v) => [0, 1, 2, 7].every((k) => Number.isFinite(pose(frame, v)[k])));
  let ends = 0;
  while (ends < count && isThere(ends)) ends++;
  const built = [voxels.map((v) => [...SITES[v].map((k) => k + 0.5), 1, 0, 0, 0, 1])];
  const width = physics.edge;
  const moving = Array.from({ length: ends }, (_, frame) =>
    voxels.map((v) => Array.from(pose(frame, v), (value, k) => (k < 3 || k === 7 ? value / width : value))),
  );
  const movement = ends ? moving : built;
  const centres = movement.map((rows) => [0, 1, 2].map((axis) => meanOf(rows.map((row) => row[axis]))));
  const fromCentre = movement.map((rows, f) => rows.map((row) => [0, 1, 2].map((k) => row[k] - centres[f][k])));
  const edges = movement.map((rows) => rows.map((row) => row[7]));
  const scale = Math.max(1, ...[fromCentre, edges].map((values) => largest(values.flat(2))));
  const last = movement.length - 1;
  const kept = Array.from({ length: count }, (_, frame) => Math.min(frame, last));
  const counts = (rows, by) =>
    base64(Int16Array.from(kept.flatMap((f) => rows[f].flat()), (v) => (v / by) * STEPS + HALF_WAY - HALF_WAY));
  const name = `${design} · ${digits.join("")}`;
  const fitness = Number.isNaN(dx) ? null : Math.sqrt(dx * dx + dy * dy);
  const cycles = Number(((physics.duration - physics.settle_time) * physics.frequency_hz).toPrecision(4));
  const words = fitness === null ? "diverged" : fitness.toFixed(2);
  return {
    label: `${name} · ${words}${fitness === null ? "" : ` in ${cycles} ${cycles === 1 ? "cycle" : "cycles"}`}`,
    short_label: `${design} · ${words}`,
    design,
    digits: digits.join(""),
    shape: [2, 2, 2],
    fitness,
    last,
    distance: distanceOf(fromCentre[0], edges[0], style),
    active: voxels.map((v) => Number(digits[v] === 2)),
    scale,
    centre: base64(Float32Array.from(kept.flatMap((f) => centres[f]))),
    position: counts(fromCentre, scale),
    quaternion: counts(movement.map((rows) => rows.map((row) => row.slice(3, 7))), 1),
    edge: counts(edges, scale),
  };
}

function meanOf(values) {
  return values.length ? values.reduce((sum, value) => sum + value, 0) / values.length : 0;
}

function largest(values) {
  return values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
}

/** The distance at which the camera sees the whole robot: softvox_gym.rendering.fitting_distance. */
function distanceOf(places, edges, { fill, smallest_radius }) {
  const reach = places.map(([x, y, z], i) => Math.sqrt(x * x + y * y + z * z) + Math.sqrt(0.75) * edges[i]);
  return fill * Math.max(smallest_radius, ...reach);
}

function base64(array) {
  const bytes = new Uint8Array(array.buffer);
  let text = "";
  for (let k = 0; k < bytes.length; k += 0x8000) text += String.fromCharCode(...bytes.subarray(k, k + 0x8000));
  return btoa(text);
}

/** The bytes of a text in base64. */
export function unbase64(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/**
 * Return recordings of the same designs in several named worlds as one, as softvox_view.replay.versus
 * does: each design's robots are in one panel, side by side. All use the coarsest clock, and show the
 * nearest frame in time, counted from the start of the pump.
 */
export function together(recordings, names) {
  const [first] = recordings;
  if (recordings.length === 1) return first;
  const step = Math.max(...recordings.map((one) => one.seconds_per_frame));
  const settle_time = Math.max(...recordings.map((one) => one.settle_time));
  const ends = recordings.map((one) => ((one.frames - 1) * one.seconds_per_frame - one.settle_time) / step);
  const count = 1 + Math.floor(settle_time / step + Math.max(...ends) + 1e-6);
  const robots = first.robots.flatMap((_, i) => {
    const heading = headingOf(first.robots[i], Math.round(first.settle_time / first.seconds_per_frame));
    const apart = first.style.lane * first.robots[i].distance;
    return recordings.map((one, k) => ({
      ...timed(one.robots[i], one, step, count, settle_time),
      world: names[k],
      label: `${names[k]}: ${one.robots[i].label}`,
      short_label: `${names[k]}: ${one.robots[i].short_label}`,
      panel: i,
      shift: [-Math.sin(heading), Math.cos(heading)].map((away) => k * apart * away),
    }));
  });
  const cycles = ((count - 1) * step - settle_time) * first.frequency_hz;
  return { ...first, frames: count, seconds_per_frame: step, settle_time, cycles, robots };
}

/** The direction of a robot's path from a frame to its end, radians. */
function headingOf({ centre }, from) {
  const path = new Float32Array(unbase64(centre).buffer);
  const [x, y] = [0, 1].map((axis) => path.at(axis - 3) - path[3 * from + axis]);
  return Math.atan2(y, x);
}

/** A robot with the frames nearest to those of another clock. */
function timed(robot, { frames, seconds_per_frame, settle_time }, step, count, settled) {
  const speed = step / seconds_per_frame;
  const lead = (settle_time - settled) / seconds_per_frame;
  const nearest = (frame) => Math.min(Math.max(Math.round(frame * speed + lead), 0), frames - 1);
  const rows = (text) => {
    const bytes = atob(text);
    const size = bytes.length / frames;
    const row = (_, frame) => bytes.slice(size * nearest(frame), size * (nearest(frame) + 1));
    return btoa(Array.from({ length: count }, row).join(""));
  };
  const { centre, position, quaternion, edge } = robot;
  const moving = Object.entries({ centre, position, quaternion, edge }).map(([key, text]) => [key, rows(text)]);
  const last = Math.min(Math.max(Math.floor((robot.last - lead) / speed), 0), count - 1);
  return { ...robot, ...Object.fromEntries(moving), last };
}
