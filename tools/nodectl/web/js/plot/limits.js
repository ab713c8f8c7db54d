// The limits of the y axis, which the user may set. An empty one follows the values.

import { el, field } from "../dom.js";
import { parseNumber } from "../format.js";

/** The limits by unit: a chart that is made again keeps them. */
const kept = new Map();

export class Limits {
  constructor(unit) {
    this.values = { min: undefined, max: undefined, ...kept.get(unit) };
    const input = (key, label) => {
      const typed = el("input", { autocomplete: "off", inputmode: "decimal", size: 7, "aria-label": `${label} of the y axis`, prop: { value: this.values[key] ?? "" } });
      typed.addEventListener("change", () => this.#take(unit, key, typed));
      return field(label, typed);
    };
    this.element = el("div", { class: "limits", role: "group", "aria-label": "Limits of the y axis" }, input("min", "y from"), input("max", "y to"));
  }

  #take(unit, key, typed) {
    const number = parseNumber(typed.value);
    const { min, max } = { ...this.values, [key]: number ?? undefined };
    const isWrong = (number == null && typed.value.trim() !== "") || (min != null && max != null && min >= max);
    typed.setCustomValidity(isWrong ? "a number; y from is below y to" : "");
    if (isWrong) return typed.reportValidity();
    this.values[key] = number ?? undefined;
    kept.set(unit, { ...this.values });
    return true;
  }
}
