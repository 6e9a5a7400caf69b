// The sliders of the physics, each with a field for any number.

import { element } from "./page.js";

/** The form of all parameters; calls onChange(parameters) when one was let go. */
export class Controls {
  #rows = {};
  #form;
  #onChange;

  constructor(form, { sliders, actuations }, onChange) {
    this.#form = form;
    this.#onChange = onChange;
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const { name, label, unit, standard, ...limits } of sliders) {
      const range = element("input", { type: "range", ...limits, "aria-label": label });
      const field = element("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
      this.#add(name, unit ? `${label}, ${unit}` : label, field, standard, range);
    }
    const modes = actuations.map((mode) => new Option(mode.replaceAll("_", " "), mode));
    this.#add("actuation", "Actuation", element("select", {}, ...modes), actuations[0]);
  }

  /** Show parameters, texts by name; what is missing is as published, and what is unknown left out. */
  set parameters(values) {
    for (const [name, row] of Object.entries(this.#rows)) {
      this.#fill(row, values[name] ?? row.standard);
      if (row.range) row.range.value = row.field.value;
    }
    this.complain();
  }

  /** Say under a parameter what is wrong, and of no other; return whether there is such a parameter. */
  complain(name, message = "") {
    if (name && !Object.hasOwn(this.#rows, name)) return false;
    for (const [own, { field, error }] of Object.entries(this.#rows)) {
      error.textContent = own === name ? message : "";
      field.setAttribute("aria-invalid", own === name);
    }
    return Boolean(name);
  }

  #add(name, text, field, standard, range) {
    field.id = `value-${name}`;
    const error = element("p", { class: "error", id: `error-${name}` });
    field.setAttribute("aria-describedby", error.id);
    const label = element("label", { for: field.id, text });
    const box = element("div", { class: "parameter" }, label, range ?? "", field, error);
    const row = { box, field, range, error, standard };
    field.addEventListener("change", () => {
      this.#fill(row, field.value.trim() || standard);
      if (range) range.value = field.value;
      this.#changed();
    });
    if (range) {
      range.id = `slider-${name}`;
      // The published value need not be a whole number of steps: the slider's nearest stands for it.
      range.addEventListener("input", () => {
        const isNearest = Math.abs(range.value - standard) < range.step / 2;
        this.#fill(row, isNearest ? standard : range.value);
      });
      range.addEventListener("change", () => this.#changed());
    }
    this.#rows[name] = row;
    this.#form.append(box);
  }

  /** Tell what differs from the published physics. */
  #changed() {
    this.complain();
    const changed = Object.entries(this.#rows).filter(([, { field, standard }]) => field.value !== standard);
    this.#onChange(Object.fromEntries(changed.map(([name, { field }]) => [name, field.value])));
  }

  #fill({ box, field, standard }, text) {
    field.value = text;
    box.classList.toggle("changed", text !== standard);
  }
}
