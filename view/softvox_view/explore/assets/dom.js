// Elements of the page.

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
