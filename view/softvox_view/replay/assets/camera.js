/** The camera on robots, its projection, and the ruler along their way. */

const NEAREST = 0.05; // voxel widths
const MOST_TICKS = 2000; // of a ruler, on either side of the start

const add = (a, b, s = 1) => a.map((value, i) => value + s * b[i]);
const times = (a, s) => a.map((value) => value * s);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const within = (value, low, high) => Math.min(Math.max(value, low), high);
const inRadians = (degrees) => (degrees * Math.PI) / 180;

/** The way of the first of some robots, which has the ruler: as in softvox_gym.rendering.Stage. */
export class Route {
  constructor(style, bodies) {
    const [from, to] = [bodies[0].begin, bodies[0].frames - 1].map((frame) => bodies[0].centre(frame));
    const way = [to[0] - from[0], to[1] - from[1]];
    const isWay = Math.hypot(...way) >= style.nowhere;
    this.heading = isWay ? Math.atan2(way[1], way[0]) : inRadians(style.azimuth) + Math.PI / 2;
    this.origin = from.slice(0, 2);
    this.ahead = [Math.cos(this.heading), Math.sin(this.heading)];
    this.aside = [this.ahead[1], -this.ahead[0]]; // towards the viewer
    this.alone = Math.max(...bodies.map((body) => body.distance));
    this.places = bodies.flatMap((body) => pairs(body.path.subarray(3 * body.begin)));
    const [along, off] = [this.ahead, this.aside].map((axis) => this.places.map((place) => this.#on(place, axis)));
    this.gap = off.reduce((most, value) => Math.max(most, value), 0) + style.ruler_gap * this.alone;
    const [low, high] = ends(along);
    this.low = within(Math.floor(low + 0.5), -MOST_TICKS, 0);
    this.high = within(Math.ceil(high - 0.02), 1, MOST_TICKS);
    const steps = [1, 2, 5, 10, 20, 50];
    this.step = steps.find((step) => (this.high - this.low) / step <= 8) ?? 100;
    this.tick = style.tick;
    const turn = this.heading - Math.PI / 2 - inRadians(style.azimuth);
    const [x, y, z] = style.light;
    const [cosine, sine] = [Math.cos(turn), Math.sin(turn)];
    this.light = [cosine * x - sine * y, sine * x + cosine * y, z];
  }

  #on(place, axis) {
    return dot(add(place, this.origin, -1), axis);
  }

  along(place) {
    return this.#on(place.slice(0, 2), this.ahead);
  }

  /** A point at a distance along the ruler, and off it towards the viewer. */
  point(along, off = 0) {
    return add(add(this.origin, this.ahead, along), this.aside, this.gap + off);
  }

  /** The ruler's lines, x, y of both ends, the longest first. */
  lines() {
    const ticks = this.numbers().map((s) => [s, 0, s, this.tick * (s % this.step ? 1 : 2)]);
    return [[this.low, 0, this.high, 0], ...ticks].map(([a, b, c, d]) => [...this.point(a, b), ...this.point(c, d)]);
  }

  numbers() {
    return Array.from({ length: this.high - this.low + 1 }, (_, k) => this.low + k);
  }
}

const pairs = (path) => Array.from({ length: path.length / 3 }, (_, k) => [path[3 * k], path[3 * k + 1]]);
const ends = (values) => [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];

/**
 * Return a target and a distance that show all paths, or only the robots if the paths are too long.
 *
 * The picture's two directions on the floor are treated separately: right, and towards the viewer.
 */
function framed(style, route, now, count, azimuth, panel) {
  const axes = [[-Math.sin(azimuth), Math.cos(azimuth)], [Math.cos(azimuth), Math.sin(azimuth)]];
  const sides = axes.map((axis) => ends(route.places.map((place) => dot(place, axis))));
  sides[1][1] += style.ruler_gap * route.alone * (1 - 1 / count);
  const slope = Math.tan(style.field_of_view / 2);
  const aspect = panel.width / Math.min(panel.width, panel.height);
  const room = style.room * route.alone * slope;
  const [across, deep] = sides.map(([low, high]) => (high - low) / 2);
  const needed = Math.max(route.alone, (across + room) / (slope * aspect)) + 2 * deep;
  const distance = Math.min(needed, style.farthest * route.alone);
  const seen = (distance - 2 * Math.min(deep, route.alone / 4)) * slope * aspect - room;
  const target = sides.map(([low, high], i) => {
    const free = needed > distance ? Math.max((high - low) / 2 - Math.max(seen, 0), 0) : 0;
    return within(dot(now, axes[i]), (low + high) / 2 - free, (low + high) / 2 + free);
  });
  return [add(times(axes[0], target[0]), axes[1], target[1]), distance];
}

/**
 * Return the camera for the robots of a panel, whose centres are `now`. It follows them, or sees all
 * of their paths. At azimuth 0 it looks across the way, which then goes to the right.
 *
 * Lengths are voxel widths, and places are relative to `anchor`, a grid point near the target, which
 * keeps single precision accurate. Right and up are half the picture's width and height, seen from a
 * distance of 1.
 */
export function cameraOf(style, route, now, view, panel) {
  const slope = Math.tan(style.field_of_view / 2);
  const azimuth = route.heading - Math.PI / 2 + inRadians(view.azimuth);
  const middle = times(now.reduce((sum, place) => add(sum, place)), 1 / now.length).slice(0, 2);
  const [[x, y], whole] = view.follow
    ? [middle, route.alone * now.length ** 0.5]
    : framed(style, route, middle, now.length, azimuth, panel);
  const distance = whole / view.zoom;
  const anchor = [Math.floor(x), Math.floor(y), 0];
  const target = add([x, y, style.aim * route.alone], anchor, -1);

  const elevation = inRadians(view.elevation);
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
    ...{ anchor, distance, eye, forward, right, up, rows },
    target: target.slice(0, 2),
    matrix: [0, 1, 2, 3].flatMap((j) => rows.map((row) => row[j])), // column by column
    pixels_per_width: side / (2 * slope) / distance, // at the target
  };
}

/** Return where a point, by default on the floor, is in a panel (0 to 1, right and down); null behind the eye. */
export function onPanel({ rows, anchor }, [x, y, z = 0]) {
  const [across, up, , depth] = rows.map((row) => dot(row, [...add([x, y, z], anchor, -1), 1]));
  return depth > NEAREST ? [(1 + across / depth) / 2, (1 - up / depth) / 2] : null;
}
