// The sliders of the physics, each with a field for any number.

import { element } from "./dom.js";

/** The form of all parameters; calls onChange(parameters) when one was let go. */
export class Controls {
  #rows = new Map();
  #form;
  #onChange;

  constructor(form, { sliders, actuations }, onChange) {
    this.#form = form;
    this.#onChange = onChange;
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const slider of sliders) this.#addSlider(slider);
    const modes = actuations.map((mode) => new Option(mode.replaceAll("_", " "), mode));
    this.#add("actuation", "Actuation", element("select", {}, ...modes), actuations[0]);
    this.parameters = {};
  }

  /** What differs from the published physics, as texts by name. */
  get parameters() {
    const changed = [...this.#rows].filter(([, { field, given }]) => field.value !== given);
    return Object.fromEntries(changed.map(([name, { field }]) => [name, field.value]));
  }

  /** Show parameters; what is missing is as published, and what is unknown is left out. */
  set parameters(values) {
    for (const [name, row] of this.#rows) {
      row.field.value = values[name] ?? row.given;
      if (row.range) row.range.value = row.field.value;
      this.#style(row);
    }
    this.clear();
  }

  /** Whether there is a parameter of this name. */
  has(name) {
    return this.#rows.has(name);
  }

  /** Say under a parameter what is wrong with it; return whether there is such a parameter. */
  complain(name, message) {
    if (!this.has(name)) return false;
    this.clear();
    const { field, error } = this.#rows.get(name);
    error.textContent = message;
    field.setAttribute("aria-invalid", "true");
    return true;
  }

  /** Take back all complaints. */
  clear() {
    for (const { field, error } of this.#rows.values()) {
      error.textContent = "";
      field.setAttribute("aria-invalid", "false");
    }
  }

  #addSlider({ name, label, unit, low, high, step, default: standard }) {
    const limits = { min: low, max: high, step: "any", "aria-label": label };
    const range = element("input", { type: "range", id: `slider-${name}`, ...limits });
    const field = element("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
    const row = this.#add(name, unit ? `${label}, ${unit}` : label, field, short(standard), range);
    range.addEventListener("input", () => {
      field.value = short(Math.round(range.value / step) * step);
      // The published value need not be a whole number of steps: near it the slider snaps to it.
      if (Math.abs(range.value - standard) < step / 2) field.value = row.given;
      this.#style(row);
    });
    range.addEventListener("keydown", (event) => this.#key(event, row, step));
    range.addEventListener("change", () => this.#changed(row));
  }

  /** A continuous slider would move by a hundredth of its length; the keys go by its step. */
  #key(event, row, step) {
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    row.range.value = Number(row.range.value) + by * step;
    row.range.dispatchEvent(new Event("input"));
    row.range.dispatchEvent(new Event("change"));
  }

  #add(name, text, field, given, range = null) {
    field.id = `value-${name}`;
    const error = element("p", { class: "error", id: `error-${name}` });
    field.setAttribute("aria-describedby", error.id);
    const parts = [element("label", { for: field.id, text }), range, field, error].filter(Boolean);
    const box = element("div", { class: "parameter" }, ...parts);
    const row = { box, field, range, error, given };
    field.addEventListener("change", () => {
      if (range) range.value = field.value;
      this.#changed(row);
    });
    this.#rows.set(name, row);
    this.#form.append(box);
    return row;
  }

  #changed(row) {
    row.field.value = row.field.value.trim() || row.given;
    this.#style(row);
    this.#onChange(this.parameters);
  }

  #style({ box, field, given }) {
    box.classList.toggle("changed", field.value !== given);
  }
}

/** A number without the noise of its last bits. */
function short(number) {
  return String(Number(Number(number).toPrecision(5)));
}
