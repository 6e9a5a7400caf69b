// The page's simulations, which the console offers as `softvox`.

import { Pool } from "./engine.js";
import { batchOf, displacementsOf, physicsOf, Refused, SITES, timeStep } from "./physics.js";
import { recordingOf } from "./recording.js";

const DESIGNS = 6561;
const ALL = Array.from({ length: DESIGNS }, (_, design) => design);
const BLOCK = 24; // designs: few, so that a click does not wait long
const FRAMES = { perCycle: 20, fewest: 100, most: 600 }; // of a recording, at any frequency

/** Simulates designs of the 2 x 2 x 2 lattice; a physics is anything that `physicsOf` accepts. */
export class Simulator {
  #known;
  #pool;

  constructor(known, bytes) {
    this.#known = known;
    this.#pool = new Pool(bytes);
  }

  /**
   * Return dx, dy and dz of designs in voxel widths, in order, as a Float64Array; NaN if diverged.
   *
   * @param {number[]} designs Their numbers.
   * @param {object|string} [physics] Changes to the published one by name, or a preset's name.
   * @param {object} [options] strain and phase, of every site of every design; onBlock(places,
   *   displacements), called when some designs are done; signal, which stops the work when it aborts,
   *   and then the promise never settles.
   */
  async simulate(designs, physics = {}, { strain, phase, onBlock, signal } = {}) {
    if (!designs?.[Symbol.iterator]) throw new Refused(`designs must be a list of numbers, got ${designs}`);
    const given = [...designs];
    const wrong = given.find((design) => !(Number.isInteger(design) && design >= 0 && design < DESIGNS));
    if (wrong !== undefined) throw new Refused(`there is no design ${wrong}; they are 0 to ${DESIGNS - 1}`);
    for (const [name, values] of Object.entries({ strain, phase })) {
      if (values === undefined || (values.length === 8 * given.length && [...values].every(Number.isFinite))) continue;
      throw new Refused(`${name} must be 8 finite numbers for each design`);
    }
    const checked = physicsOf(this.#known, physics);
    const moved = new Float64Array(3 * given.length);
    // Designs of one body plan side by side, as they are simulated together.
    const isVoxel = (design, i) => Math.sign(Math.floor(design / 3 ** i) % 3);
    const plan = given.map((design) => SITES.reduce((bits, _, i) => 2 * bits + isVoxel(design, i), 0));
    const order = given.map((_, place) => place).sort((a, b) => plan[b] - plan[a]);
    const run = async (places) => {
      const own = (values) => values && places.flatMap((place) => [...values.slice(8 * place, 8 * place + 8)]);
      const block = places.map((place) => given[place]);
      const options = { strain: own(strain), phase: own(phase) };
      const { facts } = await this.#pool.run(() => batchOf(this.#known, checked, block, options), { signal });
      const by = displacementsOf(facts, checked, block);
      places.forEach((place, i) => moved.set(by.subarray(3 * i, 3 * i + 3), 3 * place));
      onBlock?.(places, by);
    };
    const count = Math.ceil(order.length / BLOCK);
    const blocks = Array.from({ length: count }, (_, k) => order.slice(k * BLOCK, (k + 1) * BLOCK));
    await Promise.all(blocks.map(run));
    return moved;
  }

  /** Return the displacements of all designs. */
  landscape(physics = {}, options = {}) {
    return this.simulate(ALL, physics, options);
  }

  /**
   * Return designs in motion, before all other waiting work: {recording: for the player, moved: their
   * displacements}.
   */
  async recording(designs, physics = {}) {
    const checked = physicsOf(this.#known, physics);
    const { frequency_hz, duration } = checked;
    const wish = FRAMES.perCycle * frequency_hz * duration;
    const count = Math.min(Math.max(wish, FRAMES.fewest), FRAMES.most);
    const every = Math.max(1, Math.round(duration / timeStep(checked) / count));
    const batch = () => batchOf(this.#known, checked, designs, { frames: every });
    const made = await this.#pool.run(batch, { isUrgent: true });
    const recording = recordingOf(made, checked, designs, every, this.#known.style);
    return { recording, moved: displacementsOf(made.facts, checked, designs) };
  }
}
