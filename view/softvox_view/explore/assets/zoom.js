// The visible part of the map, and the gestures that change it.

const NEAREST_CELLS = 3; // across
const ZOOM_PER_LINE = 1.1; // of a wheel
const SCROLLING = 200; // ms during which a wheel that just scrolled the page goes on doing so
const TREMBLE = 6; // px: a press that moves less is still a click

/** A square of cells, {left, bottom, span}, shared by any number of maps; places are shares [across, up] of it. */
export class MapWindow {
  watchers = []; // called when it moved

  constructor(side) {
    Object.assign(this, { side, left: 0, bottom: 0, span: side });
  }

  get isWhole() {
    return this.span === this.side;
  }

  /** The cell [column, row] at a place, the nearest on the map. */
  cellAt([across, up]) {
    const on = (k) => Math.min(Math.max(Math.floor(k), 0), this.side - 1);
    return [on(this.left + across * this.span), on(this.bottom + up * this.span)];
  }

  /** Zoom in by a factor, 0 for the whole map; what was at `from` is then at `to`, if the map's edge allows. */
  zoom(factor, from = [0.5, 0.5], to = from) {
    const span = Math.min(Math.max(this.span / factor, NEAREST_CELLS), this.side);
    const [left, bottom] = from.map((share, axis) => share * this.span - to[axis] * span);
    this.span = span;
    this.#moveTo(this.left + left, this.bottom + bottom);
  }

  /** Move as little as needed to show a whole cell. */
  include([column, row]) {
    const to = (low, k) => Math.min(Math.max(low, k + 1 - this.span), k);
    this.#moveTo(to(this.left, column), to(this.bottom, row));
  }

  #moveTo(left, bottom) {
    [this.left, this.bottom] = [left, bottom].map((k) => Math.min(Math.max(k, 0), this.side - this.span));
    this.watchers.forEach((watcher) => watcher());
  }
}

/**
 * Let mouse and touch move a window over its canvas: wheel and two fingers zoom, a drag pans. Calls
 * onPoint(place) under a mouse, or null once it has left, and onPick(place).
 */
export function gestures(canvas, seen, onPoint, onPick) {
  const pressed = new Map(); // by pointer: [x, y] in pixels
  let start = null;
  let isDrag = false;
  let scrolled = -Infinity;
  addEventListener("scroll", ({ timeStamp }) => (scrolled = timeStamp));
  const on = (type, handler) => canvas.addEventListener(type, handler, { passive: false });
  const pixelOf = ({ clientX, clientY }) => [clientX, clientY];
  const apart = ([x, y], [u, v]) => Math.hypot(x - u, y - v);
  const placeOf = ([x, y]) => {
    const box = canvas.getBoundingClientRect();
    return [(x - box.left) / box.width, (box.bottom - y) / box.height];
  };
  const fingers = () => {
    const [a, b] = [[...pressed.values()][0], [...pressed.values()].at(-1)];
    return { middle: placeOf(a.map((k, axis) => (k + b[axis]) / 2)), spread: apart(a, b) || 1 };
  };

  on("wheel", (event) => {
    const lines = (event.deltaMode ? event.deltaY : event.deltaY / 40) * (event.ctrlKey ? 8 : 1);
    if (seen.isWhole && (lines > 0 || event.timeStamp - scrolled < SCROLLING)) return; // it is for the page
    event.preventDefault();
    const place = placeOf(pixelOf(event));
    seen.zoom(ZOOM_PER_LINE ** -Math.min(Math.max(lines, -4), 4), place);
    onPoint(place);
  });
  on("pointerdown", (event) => {
    if (event.button) return;
    if (!pressed.size) [start, isDrag] = [pixelOf(event), false];
    pressed.set(event.pointerId, pixelOf(event));
    canvas.setPointerCapture(event.pointerId);
  });
  on("pointermove", (event) => {
    const pixel = pixelOf(event);
    if (!pressed.has(event.pointerId)) return onPoint(placeOf(pixel));
    isDrag ||= pressed.size > 1 || apart(pixel, start) > TREMBLE;
    if (!isDrag) return;
    const before = fingers();
    pressed.set(event.pointerId, pixel);
    const now = fingers();
    seen.zoom(now.spread / before.spread, before.middle, now.middle);
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
    on(type, ({ pointerId }) => pressed.delete(pointerId));
  }
  on("pointerleave", () => onPoint(null));
  on("click", (event) => {
    if (!isDrag) onPick(placeOf(pixelOf(event)));
    isDrag = false;
  });
}
