// The sliders of the physics, each with a field for any number.

import { element } from "./page.js";

const PUBLISHED = "published";

/** The form of all parameters; it calls onChange(parameters) when a control is released. */
export class Controls {
  #rows = {};
  #form;
  #onChange;
  #presets;
  #others = {}; // parameters without a row

  constructor(form, { specs, tilts, actuations, presets }, onChange) {
    this.#form = form;
    this.#onChange = onChange;
    this.#presets = presets;
    form.addEventListener("submit", (event) => event.preventDefault());
    const choice = (names) =>
      element("select", {}, ...names.map((name) => new Option(name.replaceAll("_", " "), name)));
    this.#add("preset", "World", choice(Object.keys(presets)), PUBLISHED);
    for (const { name, label, unit, slider } of [...specs, ...tilts].filter((spec) => spec.slider)) {
      const [min, max, step] = slider;
      const range = element("input", { type: "range", min, max, step, "aria-label": label });
      const field = element("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
      this.#add(name, unit ? `${label}, ${unit}` : label, field, "0", range);
    }
    this.#add("actuation", "Actuation", choice(actuations), actuations[0]);
  }

  /** Show parameters, texts by name; missing ones have their published values. */
  set parameters(values) {
    this.#others = Object.fromEntries(Object.entries(values).filter(([name]) => !this.#rows[name]));
    const world = this.#presets[values.preset] ?? this.#presets[PUBLISHED];
    for (const [name, row] of Object.entries(this.#rows)) {
      const standard = world[name] ?? row.standard;
      row.standard = typeof standard === "number" ? String(Number(standard.toPrecision(5))) : standard;
      this.#fill(row, values[name] ?? row.standard);
      if (row.range) row.range.value = row.field.value;
    }
    this.complain();
  }

  /** Show an error under a parameter, and clear all others; return whether there is such a parameter. */
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
      // Choosing a world discards all changes.
      if (name === "preset") this.parameters = { preset: field.value };
      this.#fill(row, field.value.trim() || row.standard);
      if (range) range.value = field.value;
      this.#changed();
    });
    if (range) {
      range.id = `slider-${name}`;
      // The published value may lie between steps: the slider's nearest step stands for it.
      range.addEventListener("input", () => {
        const isNearest = Math.abs(range.value - row.standard) < range.step / 2;
        this.#fill(row, isNearest ? row.standard : range.value);
      });
      range.addEventListener("change", () => this.#changed());
    }
    this.#rows[name] = row;
    this.#form.append(box);
  }

  /** Show what differs from the published physics, or from the chosen world. */
  #changed() {
    this.complain();
    const changed = Object.entries(this.#rows).filter(([, { field, standard }]) => field.value !== standard);
    const texts = Object.fromEntries(changed.map(([name, { field }]) => [name, field.value]));
    this.#onChange({ ...this.#others, ...texts });
  }

  #fill({ box, field, standard }, text) {
    field.value = text;
    box.classList.toggle("changed", text !== standard);
  }
}
