// Searchers that run in the page, on the published landscape; all others are recorded.

const SITE_COUNT = 8;

export const SEARCHERS = { random, hill_climber: hillClimber };

/** Run a searcher for a number of different designs; returns {designs, fitness, recommended}. */
export function search(name, { seed, budget }, table) {
  const designs = [];
  const told = new Map();
  const ask = (design) => {
    if (designs.length === budget) return false;
    designs.push(design);
    told.set(design, table[design]);
    return true;
  };
  SEARCHERS[name](ask, told, shuffled(table.keys(), randomOf(seed)));
  const fitness = designs.map((design) => table[design]);
  return { designs, fitness, recommended: designs[fitness.indexOf(Math.max(...fitness))] };
}

/** Designs in random order. */
function random(ask, told, { order }) {
  order.every(ask);
}

/** Try up to eight unknown neighbours, move to the best if it is better; else restart at random. */
function hillClimber(ask, told, { order, shuffle }) {
  const best = (designs) => designs.reduce((a, b) => (told.get(b) > told.get(a) ? b : a));
  for (let here of order) {
    if (told.has(here)) continue;
    if (!ask(here)) return;
    for (;;) {
      const around = neighbours(here);
      const top = best([here, ...around.filter((design) => told.has(design))]);
      const unknown = shuffle(around.filter((design) => !told.has(design)));
      if (top === here && !unknown.length) break;
      if (top !== here) here = top;
      else if (!unknown.slice(0, SITE_COUNT).every(ask)) return;
    }
  }
}

function neighbours(design) {
  return Array.from({ length: 2 * SITE_COUNT }, (_, k) => {
    const weight = 3 ** (k >> 1);
    const digit = Math.floor(design / weight) % 3;
    return design + weight * (((digit + 1 + (k & 1)) % 3) - digit);
  });
}

/** Random numbers from 0 to 1: mulberry32, by Tommy Ettinger, in the public domain. */
function randomOf(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

function shuffled(designs, draw) {
  const shuffle = (given) => {
    const left = [...given];
    return left.map((_, k) => {
      const at = k + Math.floor(draw() * (left.length - k));
      [left[k], left[at]] = [left[at], left[k]];
      return left[k];
    });
  };
  return { order: shuffle(designs), shuffle };
}
