/** Where a robot is seen from, and how that becomes a picture. */

const NEAREST = 0.05; // voxel widths

const add = (a, b, s = 1) => a.map((value, i) => value + s * b[i]);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

/** Return the box around a path, x and y in turns: its middle, and how far its corners are apart. */
export function boxOf(pairs) {
  const low = [Infinity, Infinity];
  const high = [-Infinity, -Infinity];
  pairs.forEach((value, i) => {
    low[i % 2] = Math.min(low[i % 2], value);
    high[i % 2] = Math.max(high[i % 2], value);
  });
  if (!pairs.length) return { middle: [0, 0], across: 0 };
  const middle = [0, 1].map((axis) => (low[axis] + high[axis]) / 2);
  return { middle, across: Math.hypot(high[0] - low[0], high[1] - low[1]) };
}

/**
 * Return the camera for a robot in a frame. It follows the robot, or sees all of its path.
 *
 * Lengths are voxel widths, and places are relative to `anchor`, a grid point near the target, which
 * keeps single precision precise.
 */
export function cameraOf(style, robot, frame, view, panel) {
  const slope = Math.tan(style.field_of_view / 2);
  const { middle, across } = robot.box;
  const whole = robot.distance + (view.follow ? 0 : across / 2 / slope);
  const distance = whole / view.zoom;
  const own = [robot.centres[2 * frame] ?? 0, robot.centres[2 * frame + 1] ?? 0];
  const centre = view.follow ? own : middle;
  const anchor = [Math.floor(centre[0]), Math.floor(centre[1]), 0];
  const target = add([...centre, style.aim * robot.distance], anchor, -1);
  const { right, up, backward } = axesOf(view);
  const eye = add(target, backward, distance);
  const forward = backward.map((value) => -value);
  // Half the picture's width and height, seen from a distance of 1.
  const side = Math.min(panel.width, panel.height);
  const half = [(panel.width * slope) / side, (panel.height * slope) / side];
  return {
    anchor,
    distance,
    eye,
    forward,
    right: right.map((value) => value * half[0]),
    up: up.map((value) => value * half[1]),
    target: target.slice(0, 2),
    matrix: projection({ right, up, forward, eye, half, far: 40 * distance }),
    scale: side / (2 * slope) / distance, // pixels per voxel width at the target
  };
}

function axesOf(view) {
  const [azimuth, elevation] = [view.azimuth, view.elevation].map((d) => (d * Math.PI) / 180);
  const [level, rise] = [Math.cos(elevation), Math.sin(elevation)];
  const [x, y] = [Math.cos(azimuth), Math.sin(azimuth)];
  return { backward: [level * x, level * y, rise], right: [-y, x, 0], up: [-rise * x, -rise * y, level] };
}

/** Return the column-major matrix of a perspective view. */
function projection({ right, up, forward, eye, half, far }) {
  const depth = (far + NEAREST) / (far - NEAREST);
  const rows = [
    [...right.map((v) => v / half[0]), -dot(right, eye) / half[0]],
    [...up.map((v) => v / half[1]), -dot(up, eye) / half[1]],
    [...forward.map((v) => v * depth), -dot(forward, eye) * depth - depth * NEAREST - NEAREST],
    [...forward, -dot(forward, eye)],
  ];
  return new Float32Array([0, 1, 2, 3].flatMap((j) => rows.map((row) => row[j])));
}
