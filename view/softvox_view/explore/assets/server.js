// Talking to the server.

/** A request that the server refused; `parameter` names what was wrong, where it was one. */
export class Refused extends Error {
  constructor(message, parameter = null) {
    super(message);
    this.parameter = parameter;
  }
}

const UNREACHABLE =
  "The server doesn't answer or broke off; start softvox explore again, then reload the page.";

/** Requests of one kind, of which only the newest matters. */
export class Newest {
  #mine = null;

  /** Ask in place of what was asked before; null where something newer took the place of this. */
  async ask(request) {
    this.cancel();
    const mine = new AbortController();
    this.#mine = mine;
    try {
      const answer = await request(mine.signal);
      return this.#mine === mine ? answer : null;
    } catch (error) {
      if (this.#mine === mine) throw error;
      return null;
    }
  }

  /** Ask for nothing any more. */
  cancel() {
    this.#mine?.abort();
    this.#mine = null;
  }
}

async function request(path, query, signal) {
  const response = await fetch(address(path, query), { signal }).catch(broken);
  if (response.ok) return response;
  const answer = await response.json().catch(() => ({ error: `status ${response.status}` }));
  throw new Refused(answer.error, answer.parameter);
}

/** The address of an answer. */
export function address(path, query = {}) {
  const text = new URLSearchParams(query).toString();
  return text ? `${path}?${text}` : path;
}

/** Return the JSON at an address. */
export async function get(path, query, signal) {
  return (await request(path, query, signal)).json().catch(broken);
}

/** Ask for a long computation: calls `progress(done, total)`, and returns its result. */
export async function compute(path, query, signal, progress) {
  const response = await request(path, query, signal);
  for await (const event of lines(response.body)) {
    if (event.event === "progress") progress(event.done, event.total);
    else if (event.event === "done") return event;
    else if (event.event === "error") throw new Refused(event.error);
  } // or the server ended
  throw new Refused(UNREACHABLE);
}

function broken(error) {
  throw error.name === "AbortError" ? error : new Refused(UNREACHABLE);
}

async function* lines(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { done, value } = await reader.read().catch(broken);
    if (done) return;
    const parts = (rest + value).split("\n");
    rest = parts.pop();
    for (const part of parts) yield JSON.parse(part);
  }
}

/** Let the browser save a file. */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
