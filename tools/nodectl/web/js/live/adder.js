// Adds a series of any node to the plots: an object in a TPDO, or one that is read by SDO.

import { button, el, field, select, setChoices, text } from "../dom.js";
import { address, signalKey } from "../format.js";

const NUMBER = /^(BOOLEAN|INTEGER|UNSIGNED|REAL)/;

export class Adder {
  /** `onAdd` is called with a signal. */
  constructor(bus, onAdd) {
    Object.assign(this, { bus, onAdd, signals: [] });
    this.node = select([], null, () => this.#load());
    this.object = select([["", "choose a node"]], "", () => {});
    this.result = el("p", { class: "hint", role: "status" });
    const bar = el("div", { class: "bar" }, field("Series of node", this.node), field("Object", this.object), button("Add", () => this.#add()));
    this.element = el("div", { class: "adder" }, bar, this.result);
    bus.on("nodes", () => this.#nodes());
  }

  #nodes() {
    setChoices(this.node, [["", "choose"], ...this.bus.list().map(({ node, name }) => [String(node), `${node}: ${name ?? "unknown device"}`])]);
  }

  /** The objects of the node: those in its TPDOs first, then all numbers of its dictionary. */
  async #load() {
    if (this.node.value === "") return;
    const node = Number(this.node.value);
    text(this.result, "");
    try {
      const { signals } = await this.bus.request("signals", { node });
      const { entries } = await this.bus.request("dictionary", { node });
      if (node !== Number(this.node.value)) return;
      const sent = signals.filter(({ kind }) => kind !== "text");
      const keys = new Set(sent.map(({ signal }) => signal));
      const read = entries.filter(({ type, access }) => NUMBER.test(type) && access !== "wo").map((entry) => ofEntry(node, entry));
      this.signals = [...sent, ...read.filter(({ signal }) => !keys.has(signal))];
      setChoices(this.object, this.signals.map(({ signal, index, sub, name, tpdo }) => [signal, `${address(index, sub)} ${name}${tpdo == null ? ", by SDO" : ""}`]));
    } catch (error) {
      text(this.result, error.message);
    }
  }

  #add() {
    const signal = this.signals.find(({ signal }) => signal === this.object.value);
    text(this.result, signal ? "" : "Choose a node and an object.");
    if (signal) this.onAdd(signal);
  }
}

function ofEntry(node, { index, sub, name, path, unit }) {
  return { signal: signalKey(node, index, sub), node, index, sub, name, path, unit: /^[0-9A-F]{4}h/.test(unit) ? "" : unit, tpdo: null, kind: "number" };
}
