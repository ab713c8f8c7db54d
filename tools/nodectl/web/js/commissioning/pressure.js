// A pressure channel: auto-zero and span.

import { button, el, text } from "../dom.js";
import { quantity, signalKey } from "../format.js";
import { outcome } from "../outcome.js";
import { objectField, write } from "../parts/objects.js";

/** "zero" as the four bytes of an UNSIGNED32, the value for 6125h (CiA 404). */
const ZERO = 0x6f72657a;
/** In a module of two devices the transmitter is the second one, 800h higher. */
const SECOND_DEVICE = 0x800;

export class Pressure {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder });
    this.value = el("output", { class: "big" }, "-");
    this.result = outcome();
    this.fields = el("div", { class: "object-fields" });
    this.element = el("section", { class: "box", "aria-labelledby": "pressure-title" }, el("h3", { id: "pressure-title" }, "Pressure channel"),
      el("div", { class: "bar" }, this.value, button("Auto-zero", () => this.#zero())), this.result.line, this.fields);
  }

  static isFor(personality) {
    return personality === "pressure" || personality === "combined";
  }

  async show() {
    this.shift = this.bus.node().personality === "combined" ? SECOND_DEVICE : 0;
    this.key = signalKey(this.bus.chosen, 0x6130 + this.shift, 1);
    if (this.shown !== this.bus.chosen) this.#layFields();
    for (const { show } of this.all) await show();
  }

  /** The fields of the chosen node. Values that were typed for another node are dropped. */
  #layFields() {
    this.shown = this.bus.chosen;
    this.all = [["Span start", 0x6148], ["Span end", 0x6149], ["Offset", 0x6124]].map(([label, index]) => objectField(this.bus, label, index + this.shift, 1));
    this.fields.replaceChildren(...this.all.map(({ element }) => element));
    this.offset = this.all.at(-1);
  }

  get keys() {
    return [this.key];
  }

  draw() {
    const { newest } = this.recorder.of(this.key);
    if (newest !== undefined) text(this.value, quantity(newest, this.recorder.signals.get(this.key)?.unit));
  }

  async #zero() {
    const done = await this.result.of("zeroing", write(this.bus, 0x6125 + this.shift, 1, ZERO), "the present pressure is zero now");
    if (done !== undefined) await this.offset.show();
  }
}
