/** The robots of a recording: their voxels at every frame, and derived quantities. */

const COUNTS = 2 ** 15 - 1; // the count that stands for 1

// The corners of a cube, by bits x, y, z; those of its faces +x, -x, +y, -y, +z, -z, anticlockwise.
export const CUBE_CORNERS = Array.from({ length: 8 }, (_, c) => [0, 1, 2].map((axis) => 2 * ((c >> axis) & 1) - 1));
export const CUBE_FACES = [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];

export const NUMBERS_PER_FACE = 13; // four corners, and whether it is active

/** One robot. Lengths are voxel widths; if a scene has several robots, each is shifted. */
export class Body {
  #skin;
  #position; // of each voxel from the centre of mass
  #quaternion; // w, x, y, z
  #edge;

  /** @param {number} begin The frame at which the pump starts. */
  constructor(robot, begin) {
    const numbers = (name, scale) => Float64Array.from(new Int16Array(bytesOf(robot[name]).buffer), (n) => (n / COUNTS) * scale);
    Object.assign(this, { begin, voxels: robot.active.length, active: robot.active, distance: robot.distance });
    const shift = [...(robot.shift ?? [0, 0]), 0];
    this.path = new Float32Array(bytesOf(robot.centre).buffer).map((value, i) => value + shift[i % 3]);
    this.frames = this.path.length / 3;
    this.#position = numbers("position", robot.scale);
    this.#quaternion = numbers("quaternion", 1);
    this.#edge = numbers("edge", robot.scale);
    this.#skin = joined(sitesOf(robot));
  }

  /** The centre of mass: x, y, z. */
  centre(frame) {
    return [...this.path.subarray(3 * frame, 3 * frame + 3)];
  }

  /** The distance from where it was when the pump started. */
  gone(frame) {
    const [[x, y], [from, on]] = [this.centre(frame), this.centre(this.begin)];
    return frame < this.begin ? 0 : Math.hypot(x - from, y - on);
  }

  edge(frame, voxel) {
    return this.#edge[frame * this.voxels + voxel];
  }

  /** The volume of its voxels, relative to the volume as built. */
  volume(frame) {
    const cubes = (k) => this.#edge.subarray(k * this.voxels, (k + 1) * this.voxels).map((edge) => edge ** 3);
    const [now, built] = [frame, 0].map((k) => cubes(k).reduce((sum, cube) => sum + cube, 0));
    return this.voxels ? now / built : 1;
  }

  position(frame, voxel) {
    const first = 3 * (frame * this.voxels + voxel);
    return this.centre(frame).map((value, axis) => value + this.#position[first + axis]);
  }

  /** A unit quaternion: w, x, y, z. */
  quaternion(frame, voxel) {
    const first = 4 * (frame * this.voxels + voxel);
    const values = [...this.#quaternion.subarray(first, first + 4)];
    const length = Math.hypot(...values);
    return values.map((value) => value / length);
  }

  /** The corners of its voxels, x, y, z in turn; with a skin, neighbours share the mean of their corners. */
  corners(frame, isSkin) {
    const places = new Float64Array(24 * this.voxels);
    for (let v = 0; v < this.voxels; v++) {
      const axes = rotation(this.quaternion(frame, v));
      const [middle, half] = [this.position(frame, v), this.edge(frame, v) / 2];
      CUBE_CORNERS.forEach(([x, y, z], c) => {
        axes.forEach(([i, j, k], axis) => (places[24 * v + 3 * c + axis] = middle[axis] + half * (i * x + j * y + k * z)));
      });
    }
    return isSkin ? averaged(places, this.#skin.group) : places;
  }

  /** The faces visible from outside, relative to a point: 13 numbers each. */
  faces(frame, isSkin, [x, y, z]) {
    const places = this.corners(frame, isSkin);
    const faces = [];
    for (let v = 0; v < this.voxels; v++) {
      CUBE_FACES.forEach((corners, face) => {
        if (isSkin && !this.#skin.outside[6 * v + face]) return;
        for (const corner of corners) {
          const at = 24 * v + 3 * corner;
          faces.push(places[at] - x, places[at + 1] - y, places[at + 2] - z);
        }
        faces.push(this.active[v]);
      });
    }
    return faces;
  }

  /** The greatest depth of a corner below the floor. */
  sunk() {
    let lowest = 0;
    for (let frame = this.begin; frame < this.frames; frame += 3) {
      const places = this.corners(frame, true);
      for (let i = 2; i < places.length; i += 3) lowest = Math.min(lowest, places[i]);
    }
    return -lowest;
  }
}

/** Return the site of the lattice where each voxel was built. */
function sitesOf({ digits, shape = [2, 2, 2] }) {
  const [nx, ny] = shape;
  const sites = [...digits].map((_, i) => [i % nx, Math.floor(i / nx) % ny, Math.floor(i / nx / ny)]);
  return sites.filter((_, i) => digits[i] !== "0");
}

/** Return which corners coincide, as neighbours share them, and which faces are outside. */
function joined(sites) {
  const places = new Map(sites.map((site, v) => [site.join(), v]));
  const group = Int32Array.from({ length: 8 * sites.length }, (_, i) => i);
  const outside = new Uint8Array(6 * sites.length).fill(1);
  const pairs = [];
  sites.forEach((site, v) => {
    for (let axis = 0; axis < 3; axis++) {
      const other = places.get(site.map((value, k) => value + Number(k === axis)).join());
      if (other === undefined) continue;
      outside[6 * v + 2 * axis] = outside[6 * other + 2 * axis + 1] = 0;
      for (let c = 0; c < 8; c++) if ((c >> axis) & 1) pairs.push([8 * v + c, 8 * other + c - (1 << axis)]);
    }
  });
  for (let isDone = false; !isDone; ) {
    isDone = true;
    for (const [one, other] of pairs) {
      if (group[one] === group[other]) continue;
      group[one] = group[other] = Math.min(group[one], group[other]);
      isDone = false;
    }
  }
  return { group, outside };
}

function averaged(places, group) {
  const [sums, count] = [new Float64Array(places.length), new Float64Array(group.length)];
  group.forEach((of, i) => {
    count[of]++;
    for (let axis = 0; axis < 3; axis++) sums[3 * of + axis] += places[3 * i + axis];
  });
  return places.map((_, k) => sums[3 * group[Math.floor(k / 3)] + (k % 3)] / count[group[Math.floor(k / 3)]]);
}

/** Return the rows of the rotation matrix of a unit quaternion. */
function rotation([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

const bytesOf = (base64) => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
