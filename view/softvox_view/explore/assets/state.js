// What is seen, as the part of the address after #: only what differs from the defaults.

export const DEFAULTS = {
  design: "6453",
  compare: "",
  map: "fitness",
  results: "",
  searcher: "",
  seed: "1",
  budget: "100",
};
/** What tells something only beside a searcher, and then always. */
const OF_PATH = ["results", "seed", "budget"];

export const KINDS = ["fitness", "heading", "noise", "difference"];

/** Return the state that an address tells: texts by name; whatever else it has are parameters. */
export function read(hash) {
  const state = { ...DEFAULTS, parameters: {} };
  for (const [name, value] of new URLSearchParams(hash.replace(/^#/, ""))) {
    if (name in DEFAULTS) state[name] = value;
    else state.parameters[name] = value;
  }
  if (!KINDS.includes(state.map)) state.map = DEFAULTS.map;
  return state;
}

/** Return the part of the address after # that tells a state. */
export function written(state) {
  const query = new URLSearchParams();
  for (const name of Object.keys(DEFAULTS)) {
    const isTold = OF_PATH.includes(name)
      ? state.searcher && state[name]
      : state[name] !== DEFAULTS[name];
    if (isTold) query.set(name, state[name]);
  }
  for (const [name, value] of Object.entries(state.parameters)) query.set(name, value);
  return query.toString();
}
