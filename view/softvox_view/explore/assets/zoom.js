// The part of the map that is seen, and the gestures that change it.

import { element } from "./page.js";

const NEAREST_CELLS = 3; // across
const ZOOM_PER_LINE = 1.1; // of a wheel
const TREMBLE = 6; // px: a press that moves less is still a click

/** A square of cells, {left, bottom, span}; places are shares [across, up] of it. */
export class MapWindow {
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

  /** Zoom in by a factor; what was seen at one place is seen at another then, as a rule the same. */
  zoom(factor, from = [0.5, 0.5], to = from) {
    const span = Math.min(Math.max(this.span / factor, NEAREST_CELLS), this.side);
    const [left, bottom] = from.map((share, axis) => share * this.span - to[axis] * span);
    this.span = span;
    this.#moveTo(this.left + left, this.bottom + bottom);
  }

  /** Move as little as shows a whole cell. */
  include([column, row]) {
    const to = (low, k) => Math.min(Math.max(low, k + 1 - this.span), k);
    this.#moveTo(to(this.left, column), to(this.bottom, row));
  }

  #moveTo(left, bottom) {
    const on = (k) => Math.min(Math.max(k, 0), this.side - this.span);
    [this.left, this.bottom] = [on(left), on(bottom)];
  }
}

/**
 * Let mouse and touch move a window over its canvas: the wheel and two fingers zoom, a drag pans.
 * Calls onMove() then, onPoint(place) under a mouse, or null where it has left, and onPick(place).
 */
export function gestures(canvas, seen, { onMove, onPoint, onPick }) {
  const pressed = new Map(); // by pointer: {x, y} in pixels
  let start = null;
  let isDrag = false;
  const on = (type, handler) => canvas.addEventListener(type, handler, { passive: false });

  const placeOf = (x, y) => {
    const box = canvas.getBoundingClientRect();
    return [(x - box.left) / box.width, (box.bottom - y) / box.height];
  };
  const of = ({ clientX, clientY }) => placeOf(clientX, clientY);

  /** Where the fingers are, {middle, apart}. */
  const fingers = () => {
    const all = [...pressed.values()];
    const [a, b] = [all[0], all.at(-1)];
    return { middle: placeOf((a.x + b.x) / 2, (a.y + b.y) / 2), apart: Math.hypot(a.x - b.x, a.y - b.y) || 1 };
  };

  on("wheel", (event) => {
    const lines = (event.deltaMode ? event.deltaY : event.deltaY / 40) * (event.ctrlKey ? 8 : 1);
    if (seen.isWhole && lines > 0) return; // meant for the page
    event.preventDefault();
    seen.zoom(ZOOM_PER_LINE ** -Math.min(Math.max(lines, -4), 4), of(event));
    onMove();
    onPoint(of(event));
  });
  on("pointerdown", (event) => {
    if (event.button) return;
    if (!pressed.size) [start, isDrag] = [event, false];
    pressed.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  on("pointermove", (event) => {
    const { pointerId, clientX: x, clientY: y } = event;
    if (!pressed.has(pointerId)) return onPoint(of(event));
    isDrag ||= pressed.size > 1 || Math.hypot(x - start.clientX, y - start.clientY) > TREMBLE;
    if (!isDrag) return;
    const before = fingers();
    pressed.set(pointerId, { x, y });
    const now = fingers();
    seen.zoom(now.apart / before.apart, before.middle, now.middle);
    onMove();
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
    on(type, ({ pointerId }) => pressed.delete(pointerId));
  }
  on("pointerleave", () => onPoint(null));
  on("click", (event) => {
    if (!isDrag) onPick(of(event));
    isDrag = false;
  });
}

/** Buttons that zoom, for who has neither wheel nor two fingers; calls zoom(factor). */
export function zoomButtons(parent, zoom) {
  for (const [text, label, factor] of [["+", "zoom in", 1.5], ["−", "zoom out", 1 / 1.5], ["fit", "whole map", 0]]) {
    const button = element("button", { type: "button", text, "aria-label": label, title: label });
    button.addEventListener("click", () => zoom(factor));
    parent.append(button);
  }
}
