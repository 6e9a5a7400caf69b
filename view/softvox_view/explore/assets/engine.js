// The engine in a browser: csrc compiled to WebAssembly, the same bits as everywhere.

/**
 * Simulate designs that share one physics.
 *
 * @param {object} wasm What an instance of the engine exports.
 * @param {object} batch shared: edge, pumped rest and settling time, then the parameters as C has
 *   them, SI; actuation: its number; shape: [nx, ny, nz]; digits, strain and phase: of every site of
 *   every design in order, phase perhaps null; track: samples per cycle; frames: steps between them.
 * @returns {object} Float64Arrays: facts, 8 per design (status, steps, start and end, m), track
 *   (from the start, m) and frames (position, m, quaternion wxyz and edge of every site), NaN where
 *   a design never got there; samples of each track, count of each design's frames.
 */
export function simulateOn(wasm, { shared, actuation, shape, digits, strain, phase, track, frames }) {
  const held = [];
  const put = (array) => {
    if (!array) return 0;
    const at = wasm.take(array.byteLength);
    if (!at) throw new Error("there is too little memory for so many designs at once");
    held.push(at);
    new array.constructor(wasm.memory.buffer, at, array.length).set(array);
    return at;
  };
  try {
    const count = digits.length / (shape[0] * shape[1] * shape[2]);
    const arrays = [digits, strain, phase].map(put);
    const at = wasm.simulate(put(shared), actuation, ...shape, count, ...arrays, track, frames);
    if (!at) throw new Error("this can't be simulated: too large a result, or too little memory");
    held.push(at);
    const [samples, rows] = new Float64Array(wasm.memory.buffer, at, 2);
    const lengths = [8 * count, 3 * samples * count, 8 * rows * digits.length];
    let next = at + 16;
    const [facts, path, poses] = lengths.map((length) => {
      next += 8 * length;
      return new Float64Array(wasm.memory.buffer, next - 8 * length, length).slice();
    });
    return { facts, samples, track: path, count: rows, frames: poses };
  } finally {
    held.forEach((address) => wasm.give_back(address));
  }
}

/** Workers that simulate: urgent batches first; batches no longer wanted never start. */
export class Pool {
  #queue = [];
  #idle;

  /** Start workers with the engine's bytes, one per processor. */
  constructor(bytes, count = navigator.hardwareConcurrency || 2) {
    const source = `${simulateOn}
const ready = new Promise((resolve) => {
  onmessage = ({ data }) => {
    onmessage = answer;
    resolve(WebAssembly.instantiate(data));
  };
});
async function answer({ data }) {
  try {
    const made = simulateOn((await ready).instance.exports, data);
    postMessage({ made }, [made.facts.buffer, made.track.buffer, made.frames.buffer]);
  } catch (error) {
    postMessage({ error: error.message });
  }
}`;
    const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    this.#idle = Array.from({ length: count }, () => {
      const worker = new Worker(address);
      worker.postMessage(bytes);
      return worker;
    });
  }

  /**
   * Simulate the batch that make() returns, as `simulateOn` does. If a signal aborts, the promise never
   * settles. A batch is made only when its turn comes, so that many batches do not block the page.
   */
  run(make, { isUrgent = false, signal } = {}) {
    return new Promise((resolve, reject) => {
      this.#queue[isUrgent ? "unshift" : "push"]({ make, resolve, reject, signal });
      this.#next();
    });
  }

  #next() {
    this.#queue = this.#queue.filter(({ signal }) => !signal?.aborted);
    if (!this.#queue.length || !this.#idle.length) return;
    const { make, resolve, reject, signal } = this.#queue.shift();
    const worker = this.#idle.pop();
    const end = (settle, value) => {
      this.#idle.push(worker);
      this.#next();
      if (!signal?.aborted) settle(value);
    };
    worker.onmessage = ({ data: { made, error } }) => (made ? end(resolve, made) : end(reject, new Error(error)));
    worker.onerror = ({ message }) => end(reject, new Error(message || "a worker could not be started"));
    worker.postMessage(make());
    this.#next();
  }
}
