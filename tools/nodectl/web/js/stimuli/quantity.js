// One quantity that the sensors of a board see: a slider, and waveforms.

import { button, el, field, newId, select, set, text } from "../dom.js";
import { number } from "../format.js";

/** The shortest time between two messages of a moving slider. */
const SEND_MS = 60;

/** The waveforms by their names in the simulator, with the names of their numbers and the initial values. */
const FORMS = {
  sine: [["Offset", (q) => (q.low + q.high) / 4], ["Amplitude", (q) => (q.high - q.low) / 10], ["Frequency, Hz", () => 0.5]],
  ramp: [["From", (q) => q.low], ["To", (q) => q.high / 2], ["Seconds", () => 10]],
  step: [["From", (q) => q.start], ["To", (q) => q.high / 2], ["After, s", () => 2]],
  noise: [["Mean", (q) => q.start], ["Deviation", (q) => (q.high - q.low) / 1000]],
};

/** `low`, `high`, `step` and all numbers are in the displayed unit; `factor` converts to the unit of the simulator. */
export class Quantity {
  constructor({ kind, name, unit, low, high, step, start, factor, offset = 0, rpm = false }, send) {
    Object.assign(this, { kind, name, unit, low, high, step, start, factor, offset, rpm, send });
    this.output = el("output", { class: "value" });
    this.spec = el("small", { class: "hint" });
    this.slider = el("input", { type: "range", min: low, max: high, step, value: start, id: newId("slider"), on: { input: () => this.#slide() } });
    this.numbers = el("div", { class: "bar" });
    this.form = select([["const", "slider"], ...Object.keys(FORMS).map((form) => [form, form]), ...(rpm ? [["rpm", "rpm"]] : [])], "const", () => this.#choose());
    this.element = el("div", { class: "quantity" }, el("label", { for: this.slider.id }, `${name}, ${unit}`), this.slider, this.output, this.form, this.numbers, this.spec);
    set(this.form, "aria-label", `Waveform of ${name}`);
  }

  /** Shows the present value at the board's sensors. */
  show({ spec, value }) {
    const shown = (value - this.offset) / this.factor;
    text(this.output, `${number(Number(shown.toFixed(3)))} ${this.unit}`);
    text(this.spec, spec);
    this.#showForm(spec.split(":")[0]);
    if (document.activeElement !== this.slider && !this.timer) this.slider.value = shown;
  }

  /** Shows the waveform of the board, unless the user is choosing another one. */
  #showForm(form) {
    if (document.activeElement === this.form || this.numbers.childElementCount > 0) return;
    if ([...this.form.options].some(({ value }) => value === form)) this.form.value = form;
  }

  #slide() {
    if (this.form.value !== "const") {
      this.form.value = "const";
      this.numbers.replaceChildren();
    }
    text(this.output, `${number(Number(this.slider.value))} ${this.unit}`);
    this.timer ||= setTimeout(() => {
      this.timer = null;
      this.send(this.kind, `const:${this.#inSimulator(Number(this.slider.value))}`);
    }, SEND_MS);
  }

  #choose() {
    const form = this.form.value;
    if (form === "const") return (this.numbers.replaceChildren(), this.#slide());
    const fields = form === "rpm" ? [["Revolutions a minute", () => 60]] : FORMS[form];
    this.inputs = fields.map(([, first]) => el("input", { type: "number", step: "any", value: Number(first(this).toFixed(3)) }));
    this.numbers.replaceChildren(...fields.map(([name], at) => field(name, this.inputs[at])), button("Apply", () => this.#apply(form)));
  }

  #apply(form) {
    const values = this.inputs.map((input) => Number(input.value));
    if (form === "rpm") return this.send(this.kind, `rpm:${values[0]}`);
    // Amplitudes and deviations have no offset. Times and frequencies do not have the unit of the quantity at all.
    const isDifference = { sine: [false, true], noise: [false, true] }[form] ?? [false, false];
    const sent = values.map((value, at) => (at > 1 ? value : isDifference[at] ? value * this.factor : this.#inSimulator(value)));
    return this.send(this.kind, `${form}:${sent.map((value) => Number(value.toFixed(6))).join(",")}`);
  }

  #inSimulator(value) {
    return Number((value * this.factor + this.offset).toFixed(6));
  }
}
