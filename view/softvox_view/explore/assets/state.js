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
/** What tells which searcher's path is shown. */
export const PATH = ["results", "searcher", "seed", "budget"];

export const KINDS = ["fitness", "heading", "noise", "difference"];

/** Return the state that an address tells: texts by name; whatever else it has are parameters. */
export function read(hash) {
  const state = { ...DEFAULTS, parameters: {} };
  for (const [name, value] of new URLSearchParams(hash.replace(/^#/, ""))) {
    if (Object.hasOwn(DEFAULTS, name)) state[name] = value;
    else state.parameters[name] = value;
  }
  return state;
}

/** Return the part of the address after # that tells a state. */
export function written(state) {
  const query = new URLSearchParams();
  for (const name of Object.keys(DEFAULTS)) {
    // All of a path is written, and nothing where there is none.
    const isWritten = PATH.includes(name) ? state.searcher && state[name] : state[name] !== DEFAULTS[name];
    if (isWritten) query.set(name, state[name]);
  }
  for (const [name, value] of Object.entries(state.parameters)) query.set(name, value);
  return query.toString();
}

/** What differs from the published physics, for people; nothing for nothing. */
export function wordsOf(parameters) {
  return Object.entries(parameters)
    .map(([name, value]) => `${name.replaceAll("_", " ")} ${value}`)
    .join(", ");
}
