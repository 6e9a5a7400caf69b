// The page's elements, and what it asks the server.

export const find = (id) => document.getElementById(id);

/** A new element: its attributes ("text" is what it says) and children. */
export function element(tag, { text, ...attributes } = {}, ...children) {
  const made = tag.startsWith("svg:")
    ? document.createElementNS("http://www.w3.org/2000/svg", tag.slice(4))
    : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  made.append(...children);
  return made;
}

/** What can't be had; `parameter` names what was wrong, where it was one. */
export class Refused extends Error {
  constructor(message, parameter) {
    super(message);
    this.parameter = parameter;
  }
}

const UNREACHABLE =
  "The server doesn't answer or broke off; start softvox explore again, then reload the page.";

const sources = {};

/** The address of an answer. */
export function address(name, query) {
  return `/api/${name}?${new URLSearchParams(query)}`;
}

/**
 * Ask the server; calls progress(done, total) meanwhile. Of one name only the newest matters: what
 * was asked before is cancelled, and never settles.
 */
export function ask(name, query, progress) {
  cancel(name);
  const source = new EventSource(address(name, query));
  sources[name] = source;
  return new Promise((resolve, reject) => {
    source.onerror = () => {
      source.close();
      reject(new Refused(UNREACHABLE));
    };
    source.onmessage = ({ data }) => {
      const event = JSON.parse(data);
      if (event.progress) return progress(...event.progress);
      source.close();
      return event.answer ? resolve(event.answer) : reject(new Refused(event.error, event.parameter));
    };
  });
}

export function cancel(name) {
  sources[name]?.close();
}

/** Let the browser save what is at an address. */
export function save(href, name) {
  element("a", { href, download: name }).click();
}

export function saveBlob(blob, name) {
  const href = URL.createObjectURL(blob);
  save(href, name);
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}
