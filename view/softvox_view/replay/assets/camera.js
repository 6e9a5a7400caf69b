/** Where a robot is seen from, and how that becomes a picture. */

const NEAREST = 0.05; // voxel widths

const add = (a, b, s = 1) => a.map((value, i) => value + s * b[i]);
const times = (a, s) => a.map((value) => value * s);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

/** Return the box around a path, x, y, z in turns: its middle, and how far its corners are apart. */
export function boxOf(path) {
  const sides = [0, 1].map((axis) => {
    const along = path.filter((_, i) => i % 3 === axis);
    return [Math.min(...along), Math.max(...along)];
  });
  const middle = sides.map(([low, high]) => (low + high) / 2);
  return { middle, across: Math.hypot(...sides.map(([low, high]) => high - low)) };
}

/**
 * Return the camera for a robot in a frame. It follows the robot, or sees all of its path.
 *
 * Lengths are voxel widths, and places are relative to `anchor`, a grid point near the target, which
 * keeps single precision precise. Right and up are half the picture's width and height, seen from a
 * distance of 1.
 */
export function cameraOf(style, robot, frame, view, panel) {
  const slope = Math.tan(style.field_of_view / 2);
  const whole = robot.distance + (view.follow ? 0 : robot.box.across / 2 / slope);
  const distance = whole / view.zoom;
  const own = [...robot.path.subarray(3 * frame, 3 * frame + 3)];
  const [x, y] = view.follow ? own : robot.box.middle;
  const anchor = [Math.floor(x), Math.floor(y), 0];
  const target = add([x, y, style.aim * robot.distance], anchor, -1);

  const [azimuth, elevation] = times([view.azimuth, view.elevation], Math.PI / 180);
  const [level, rise] = [Math.cos(elevation), Math.sin(elevation)];
  const [east, north] = [Math.cos(azimuth), Math.sin(azimuth)];
  const backward = [level * east, level * north, rise];
  const side = Math.min(panel.width, panel.height);
  const right = times([-north, east, 0], (panel.width * slope) / side);
  const up = times([-rise * east, -rise * north, level], (panel.height * slope) / side);
  const forward = times(backward, -1);
  const eye = add(target, backward, distance);

  const far = 40 * distance;
  const depth = (far + NEAREST) / (far - NEAREST);
  const rows = [
    ...[right, up].map((axis) => times([...axis, -dot(axis, eye)], 1 / dot(axis, axis))),
    [...times(forward, depth), -dot(forward, eye) * depth - depth * NEAREST - NEAREST],
    [...forward, -dot(forward, eye)],
  ];
  return {
    ...{ anchor, distance, eye, forward, right, up },
    target: target.slice(0, 2),
    centre: add(own, anchor, -1),
    matrix: [0, 1, 2, 3].flatMap((j) => rows.map((row) => row[j])), // column by column
    pixels_per_width: side / (2 * slope) / distance, // at the target
  };
}
