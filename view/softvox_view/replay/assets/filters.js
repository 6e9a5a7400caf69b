/** The choice of the robots of a gallery to show. */

const LIMITS_OF = {
  voxels: { of: (robot) => robot.active.length, step: 1 },
  active: { of: (robot) => robot.active.filter(Boolean).length, step: 1 },
  fitness: { of: (robot) => robot.fitness ?? 0, step: 0.01 },
};

/** A bar of pairs of numbers, from and to; `choose` receives the numbers of the robots that pass all. */
export class Filters {
  #element;
  #choose;
  #robots = [];

  constructor(element, choose, signal) {
    this.#element = element;
    this.#choose = choose;
    const pair = (name) => `<label>${name} <input type="number" data-of="${name}" data-end="low"
      aria-label="${name} from"> to <input type="number" data-of="${name}" data-end="high" aria-label="${name} to"></label>`;
    element.innerHTML = `${Object.keys(LIMITS_OF).map(pair).join("")}<output></output>
      <span>Each robot represents its symmetry class, and repeats its last cycle.</span>`;
    element.addEventListener("input", () => this.#apply(), { signal });
  }

  load({ robots }) {
    this.#robots = robots;
    for (const input of this.#inputs) {
      const { of, step } = LIMITS_OF[input.dataset.of];
      const values = robots.map(of);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const ends = { low: Math.floor(low / step) * step, high: Math.ceil(high / step) * step };
      const value = Number(ends[input.dataset.end].toFixed(2));
      Object.assign(input, { step, value, min: 0 });
    }
    this.#apply();
  }

  get #inputs() {
    return this.#element.querySelectorAll("input");
  }

  #apply() {
    const isWithin = (robot, { dataset, valueAsNumber: limit }) => {
      const value = LIMITS_OF[dataset.of].of(robot);
      return Number.isNaN(limit) || (dataset.end === "low" ? value >= limit : value <= limit);
    };
    const all = this.#robots.map((_, i) => i);
    const shown = all.filter((i) => [...this.#inputs].every((input) => isWithin(this.#robots[i], input)));
    this.#element.querySelector("output").textContent = `${shown.length} of ${all.length} robots`;
    this.#choose(shown);
  }
}
