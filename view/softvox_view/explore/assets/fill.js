// A panel that fills the page, or the screen.

/** Let the buttons "fill" and "screen" of panels do so; Escape ends both. */
export function fillable(panels) {
  const fill = (filling) => {
    for (const panel of panels) {
      panel.classList.toggle("filling", panel === filling);
      panel.querySelector(".fill").setAttribute("aria-pressed", panel === filling);
    }
    document.body.classList.toggle("filled", Boolean(filling));
  };
  for (const panel of panels) {
    const [button, screen] = [".fill", ".screen"].map((name) => panel.querySelector(name));
    button.addEventListener("click", () => fill(panel.classList.contains("filling") ? null : panel));
    screen.disabled = !document.fullscreenEnabled;
    screen.addEventListener("click", () =>
      document.fullscreenElement ? document.exitFullscreen() : panel.requestFullscreen(),
    );
  }
  addEventListener("keydown", ({ key }) => key === "Escape" && fill(null));
}
