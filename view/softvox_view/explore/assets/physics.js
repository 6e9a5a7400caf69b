// The physics, as in softvox_gym.Physics. The facts about its parameters come with the page, in
// `known`: {specs, presets, actuations, parameters in C's order, stepsPerCycle, mostSteps}.

/** An invalid request; `parameter` names the wrong parameter, if there is one. */
export class Refused extends Error {
  constructor(message, parameter) {
    super(message);
    this.parameter = parameter;
  }
}

/**
 * Return a checked physics, values by name: the published one with some changes, or a preset.
 *
 * @param {object|string} changes By name; or the name of a preset, which may also be the key "preset".
 * @param {string[]} [notes] Receives notes on what is allowed but probably a mistake.
 */
export function physicsOf(known, changes = {}, notes = []) {
  if (typeof changes !== "string" && Object(changes) !== changes) {
    throw new Refused(`a physics is an object of changes or the name of a preset, got ${changes}`);
  }
  const { preset = "published", ...own } = typeof changes === "string" ? { preset: changes } : changes;
  if (!Object.hasOwn(known.presets, preset)) {
    throw new Refused(`there is no physics ${preset}; there are ${Object.keys(known.presets).join(", ")}`);
  }
  const names = known.specs.map(({ name }) => name);
  for (const name of Object.keys(own)) {
    if (!names.includes(name)) {
      throw new Refused(`${name} is no parameter; the parameters are ${names.join(", ")}`, name);
    }
  }
  const physics = { ...known.presets[preset], ...own };
  for (const spec of known.specs) checkBounds(known, spec, physics[spec.name]);
  checkTogether(known, physics, notes);
  return physics;
}

function checkBounds({ actuations }, { name, kind, words, low, high, ends }, value) {
  const isWithin = (number) =>
    typeof number === "number" &&
    (ends[0] === "[" ? number >= low : number > (low ?? -Infinity)) &&
    (ends[1] === "]" ? number <= high : number < (high ?? Infinity));
  const isVector = name === "gravity" && Array.isArray(value) && value.length === 3;
  const isGood = {
    number: () => (isVector ? value.every(isWithin) : isWithin(value)),
    flag: () => typeof value === "boolean",
    choice: () => actuations.includes(value),
  }[kind]();
  if (!isGood) throw new Refused(`${name} must be ${words}, got ${value}`, name);
}

function checkTogether(known, physics, notes) {
  const refuse = (name, reason) => {
    throw new Refused(`${name} ${reason}`, name);
  };
  const { duration, settle_time, frequency_hz, strain, actuation } = physics;
  if (duration <= settle_time) refuse("duration", `must be longer than settle_time (${settle_time} s)`);
  const step = timeStep(physics);
  if (!(step > 0 && duration / step <= known.mostSteps)) {
    refuse("duration", `of ${duration} s in time steps of ${step} s can't be counted`);
  }
  const most = 1 / (2 * step);
  if (frequency_hz > most) {
    const words = `must be at most half the steps per second, here ${most.toPrecision(4)}`;
    refuse("frequency_hz", `${words}, got ${frequency_hz}`);
  }
  if (!(loadOf(physics) < 1)) {
    const usual = known.presets.exact;
    const dampings = ["damping_link", "damping_ground", "damping_global", "poisson_ratio"];
    const cured = dampings.map((name) => loadOf({ ...physics, [name]: usual[name] }));
    const blamed = dampings[cured.indexOf(Math.min(...cured))];
    refuse(blamed, `${physics[blamed]} makes the time step unstable; lower time_step_fraction`);
  }
  if (actuation === "expand_and_contract" && strain >= 1) {
    refuse("strain", `must be below 1 where voxels expand and contract, got ${strain}`);
  }
  const { friction_static: held, friction_kinetic: sliding } = physics;
  if (sliding > held) {
    notes.push(`friction_kinetic (${sliding}) is above friction_static (${held}), which is rarely meant`);
  }
  const steps = 1 / (frequency_hz * step);
  if (steps < known.stepsPerCycle) {
    const need = `about ${known.stepsPerCycle} are needed to follow it`;
    notes.push(`frequency_hz (${frequency_hz}) leaves ${steps.toPrecision(3)} steps a cycle, and ${need}`);
  }
}

/** The time step as a share of the longest stable one; Physics in Python explains it. */
function loadOf({ time_step_fraction, damping_link, damping_ground, damping_global, poisson_ratio }) {
  const step = time_step_fraction / (2 * Math.PI);
  const link = step * (damping_link + step / 2);
  const floor = (step * (2 * damping_ground + step)) / link;
  const layers = floor > 2 ? floor + 1 + 1 / (floor - 1) : 4;
  const moving = ((8 + layers) * link) / 2 + step * damping_global;
  const shear = 1 / (2 * (1 + poisson_ratio));
  const turning = step * damping_link * (3 + Math.sqrt(shear)) + step ** 2 * (3 + shear);
  return Math.max(moving, turning, 20 * Math.sqrt(6) * step * damping_global);
}

/** x^3, correctly rounded, for whole numbers times a power of two. */
function cube(x) {
  let halvings = 0;
  while (!Number.isInteger(x)) {
    x *= 2;
    halvings += 1;
  }
  return Number(BigInt(x) ** 3n) / 2 ** (3 * halvings);
}

/** The time step, s. */
export function timeStep({ edge, youngs_modulus, density, time_step_fraction }) {
  const stiffness = youngs_modulus * edge;
  const mass = density * cube(edge);
  return time_step_fraction / (2 * Math.PI * Math.sqrt(stiffness / mass));
}

/** The physics of the page's parameters, which are texts; a tilted floor is a tilted gravity. */
export function physicsWritten(known, { preset, actuation, ...texts }, notes = []) {
  const numbers = {};
  for (const [name, text] of Object.entries(texts)) {
    numbers[name] = Number(text.trim() || NaN);
    if (Number.isNaN(numbers[name])) throw new Refused(`${name} must be a number, got '${text}'`, name);
  }
  const { tilt = 0, downhill = 0, ...own } = numbers;
  const angles = { tilt, downhill };
  for (const spec of known.tilts) checkBounds(known, spec, angles[spec.name]);
  if (preset) own.preset = preset;
  if (actuation) own.actuation = actuation;
  const physics = physicsOf(known, own, notes);
  return tilt ? { ...physics, gravity: tilted([0, 0, physics.gravity], tilt, downhill) } : physics;
}

/** Gravity, a vector, as seen from a floor tilted by some degrees towards a heading. */
export function tilted(gravity, tilt, downhill) {
  if (!tilt) return gravity;
  const [cosine, sine] = cosSin((tilt * Math.PI) / 180);
  const [x, y] = cosSin((downhill * Math.PI) / 180);
  const [gx, gy, gz] = gravity;
  const along = x * gx + y * gy;
  const change = along * cosine - gz * sine - along;
  return [gx + change * x, gy + change * y, along * sine + gz * cosine];
}

/** Cosine and sine with the same bits in every browser, as in softvox_gym.portable. */
function cosSin(angle) {
  const halvings = 8;
  const small = angle / 2 ** halvings;
  const square = small * small;
  let [cosine, sine] = [1, 1];
  for (let term = 16; term > 0; term -= 2) {
    cosine = 1 - (square / (term * (term - 1))) * cosine;
    sine = 1 - (square / (term * (term + 1))) * sine;
  }
  sine = small * sine;
  for (let k = 0; k < halvings; k++) [cosine, sine] = [cosine * cosine - sine * sine, 2 * cosine * sine];
  return [cosine, sine];
}

/** The digits of designs of the 2 x 2 x 2 lattice, one design after the other. */
export function digitsOfAll(designs) {
  return Uint8Array.from(designs.flatMap((design) => SITES.map((_, i) => Math.floor(design / 3 ** i) % 3)));
}

export const SITES = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, i >> 2]); // [x, y, z]

/** The input of `simulateOn` for designs under a physics; strain and phase may be per site. */
export function batchOf(known, physics, designs, { strain, phase, frames = 0 } = {}) {
  const digits = digitsOfAll(designs);
  const { edge, settle_time, actuation, gravity, single_precision_rest } = physics;
  const isRounded = single_precision_rest && actuation !== "expand_and_contract";
  const values = {
    ...physics,
    gravity: Array.isArray(gravity) ? gravity : [0, 0, gravity],
    time_step: timeStep(physics),
  };
  const own = known.parameters.flatMap((name) => values[name]);
  return {
    shared: Float64Array.of(edge, isRounded ? Math.fround(edge) : edge, settle_time, ...own),
    actuation: known.actuations.indexOf(actuation),
    shape: [2, 2, 2],
    digits,
    strain: strain ? Float64Array.from(strain) : new Float64Array(digits.length).fill(physics.strain),
    phase: phase ? Float64Array.from(phase) : null,
    track: 0,
    frames,
  };
}

/** dx, dy, dz of every design in voxel widths, NaN if it diverged, from `simulateOn`'s facts. */
export function displacementsOf(facts, { edge }, designs) {
  const moved = new Float64Array(3 * designs.length);
  designs.forEach((design, i) => {
    const [status, , ...places] = facts.subarray(8 * i, 8 * i + 8);
    const by = [0, 1, 2].map((axis) => (design ? (places[3 + axis] - places[axis]) / edge : 0));
    const hasFitness = Number.isFinite(by[0] * by[0] + by[1] * by[1]);
    moved.set(status === 0 && hasFitness ? by : [NaN, NaN, NaN], 3 * i);
  });
  return moved;
}
