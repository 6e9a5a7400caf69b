// The page's elements, and its embedded data.

import { unbase64 } from "./recording.js";

export const find = (id) => document.getElementById(id);

/** Without a mouse, use the texts for fingers: elements have them in data-touch. */
export function sayTouch() {
  if (!matchMedia("(pointer: coarse)").matches) return;
  for (const one of document.querySelectorAll("[data-touch]")) one.textContent = one.dataset.touch;
}

/** A new element, with attributes ("text" is its content) and children. */
export function element(tag, { text, ...attributes } = {}, ...children) {
  const made = tag.startsWith("svg:")
    ? document.createElementNS("http://www.w3.org/2000/svg", tag.slice(4))
    : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  made.append(...children);
  return made;
}

/** The bytes that Python packed into a text. */
export async function unpacked(text) {
  const plain = new Blob([unbase64(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(plain).arrayBuffer();
}

const newest = {};

/** Settle as a promise does, unless a newer one of the same name replaces it: then never. */
export function latest(name, promise) {
  newest[name] = promise;
  const isWanted = () => newest[name] === promise;
  return new Promise((resolve, reject) => {
    promise.then(
      (value) => isWanted() && resolve(value),
      (error) => isWanted() && reject(error),
    );
  });
}

/** Let the buttons "fill" of panels make them fill the page; Escape ends that. */
export function fillable(panels) {
  const fill = (filling) => {
    for (const panel of panels) {
      panel.classList.toggle("filling", panel === filling);
      panel.querySelector(".fill").setAttribute("aria-pressed", panel === filling);
    }
  };
  for (const panel of panels) {
    const toggle = () => fill(panel.classList.contains("filling") ? null : panel);
    panel.querySelector(".fill").addEventListener("click", toggle);
  }
  addEventListener("keydown", ({ key }) => key === "Escape" && fill(null));
}
