// A landscape whose physics changes: its cells fill in as results arrive, and a new request ends the old.

const KEPT = 16; // landscapes
const PAUSE = 100; // ms between updates of a landscape in progress, so that the page stays quick

const kept = new Map(); // landscapes by their physics, so that going back costs nothing

/** The values on the map from displacements: null if a design diverged, undefined if not known yet. */
export function valuesOf(dx, dy) {
  const values = { dx: [], dy: [], fitness: [] };
  dx.forEach((x, design) => put(values, design, x, dy[design]));
  return values;
}

function put({ dx, dy, fitness }, design, x, y) {
  const isThere = x === x && y === y;
  dx[design] = isThere ? x : null;
  dy[design] = isThere ? y : null;
  fitness[design] = isThere ? Math.sqrt(x * x + y * y) : null;
}

/** All designs under one physics. */
export class World {
  values; // {dx, dy, fitness}, by design
  done; // the number of designs that are known
  #simulator;
  #published;
  #onChange;
  #ending = new AbortController();
  #key; // of its physics, current or being computed

  /**
   * @param {Simulator} simulator
   * @param {object} published The landscape known beforehand: {key: its physics as JSON, values}.
   * @param {function} onChange Called when more of it is known.
   */
  constructor(simulator, published, onChange) {
    this.#simulator = simulator;
    this.#published = published;
    this.#key = published.key;
    this.#onChange = onChange;
    this.values = published.values;
    this.done = this.values.fitness.length;
  }

  get isWhole() {
    return this.done === this.values.fitness.length;
  }

  /** Take on a physics, unless it has it; the promise settles once all is known. */
  async become(physics) {
    const key = JSON.stringify(physics);
    if (key === this.#key) return;
    this.stop();
    this.#key = key;
    const known = key === this.#published.key ? this.#published.values : kept.get(key);
    if (known) return this.#take(known);
    const { signal } = this.#ending;
    const { length } = this.#published.values.fitness;
    const rows = ["dx", "dy", "fitness"].map((name) => [name, new Array(length).fill(undefined)]);
    this.#take(Object.fromEntries(rows), 0);
    const { values } = this;
    let looks = 0;
    const onBlock = (designs, moved) => {
      designs.forEach((design, i) => put(values, design, moved[3 * i], moved[3 * i + 1]));
      this.done += designs.length;
      looks ||= setTimeout(() => {
        looks = 0;
        if (!signal.aborted && !this.isWhole) this.#onChange();
      }, PAUSE);
    };
    await this.#simulator.landscape(physics, { onBlock, signal });
    if (kept.size >= KEPT) kept.delete(kept.keys().next().value);
    kept.set(key, values);
    this.#onChange();
  }

  /** Stop the computation. */
  stop() {
    this.#ending.abort();
    this.#ending = new AbortController();
    this.#key = null;
  }

  #take(values, done = values.fitness.length) {
    this.values = values;
    this.done = done;
    this.#onChange();
  }
}
