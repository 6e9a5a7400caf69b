// A panel that fills the page, or the screen.

import { element } from "./page.js";

const WORDS = { true: ["⤡", "back to the page"], false: ["⤢", "fill the page"] };

/** Give panels two buttons each: fill the page, and then the screen; Escape ends both. */
export function fillable(panels) {
  const fill = (filling) => {
    for (const panel of panels) {
      const isIt = panel === filling;
      const [sign, words] = WORDS[isIt];
      const attributes = { "aria-pressed": isIt, "aria-label": words, title: words };
      const button = panel.querySelector(".fill");
      for (const [name, value] of Object.entries(attributes)) button.setAttribute(name, value);
      button.textContent = sign;
      panel.classList.toggle("filling", isIt);
    }
    document.body.classList.toggle("filled", Boolean(filling));
  };
  for (const panel of panels) {
    const button = element("button", { type: "button", class: "fill" });
    button.addEventListener("click", () => fill(panel.classList.contains("filling") ? null : panel));
    const screen = element("button", { type: "button", class: "screen", text: "full screen" });
    screen.addEventListener("click", () => {
      if (document.fullscreenElement) document.exitFullscreen();
      else panel.requestFullscreen();
    });
    panel.querySelector(".bar").append(...(document.fullscreenEnabled ? [screen] : []), button);
  }
  addEventListener("keydown", ({ key }) => key === "Escape" && fill(null));
  fill(null);
}
