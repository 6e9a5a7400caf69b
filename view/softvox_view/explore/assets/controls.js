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
    this.#addActuation(actuations);
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
      row.range && (row.range.value = row.field.value);
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
    const row = this.#row(name, unit ? `${label}, ${unit}` : label);
    const limits = { min: low, max: high, step: "any", "aria-label": label };
    const range = element("input", { type: "range", id: `slider-${name}`, ...limits });
    const digits = { inputmode: "decimal", autocomplete: "off" };
    row.field = element("input", { type: "text", id: `value-${name}`, ...digits });
    row.given = short(standard);
    row.range = range;
    range.addEventListener("input", () => {
      row.field.value = short(Math.round(range.value / step) * step);
      // The published value need not be a whole number of steps: near it the slider snaps to it.
      if (Math.abs(range.value - standard) < step / 2) row.field.value = row.given;
      this.#style(row);
    });
    range.addEventListener("keydown", (event) => this.#key(event, row, step));
    range.addEventListener("change", () => this.#changed(row));
    row.field.addEventListener("change", () => {
      range.value = row.field.value;
      this.#changed(row);
    });
    this.#finish(name, row, range);
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

  #addActuation(actuations) {
    const row = this.#row("actuation", "Actuation");
    const options = actuations.map((mode) => new Option(mode.replaceAll("_", " "), mode));
    row.field = element("select", { id: "value-actuation" }, ...options);
    row.given = actuations[0];
    row.field.addEventListener("change", () => this.#changed(row));
    this.#finish("actuation", row, null);
  }

  #row(name, text) {
    return {
      box: element("div", { class: "parameter" }),
      label: element("label", { for: `value-${name}`, text }),
      error: element("p", { class: "error", id: `error-${name}` }),
    };
  }

  #finish(name, row, range) {
    row.field.setAttribute("aria-describedby", row.error.id);
    row.box.append(row.label, ...(range ? [range] : []), row.field, row.error);
    this.#rows.set(name, row);
    this.#form.append(row.box);
    row.field.value = row.given;
    if (range) range.value = row.given;
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
