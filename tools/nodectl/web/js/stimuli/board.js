// The controls of one board: the inputs of its sensors, its buttons, its faults.

import { button, el, field, set, text } from "../dom.js";
import { outcome } from "../outcome.js";
import { toggle } from "../parts/switch.js";
import { Quantity } from "./quantity.js";
import { hasEffect, reads } from "./uses.js";

const KELVIN = 273.15;

const QUANTITIES = [
  { kind: "pressure", name: "Pressure", unit: "bar", low: 0, high: 10, step: 0.01, start: 2.5, factor: 100_000 },
  { kind: "temperature", name: "Temperature of the chip", unit: "°C", low: -40, high: 125, step: 0.5, start: 25, factor: 1, offset: KELVIN },
  { kind: "thermistor", name: "Thermistor", unit: "°C", low: -40, high: 125, step: 0.5, start: 25, factor: 1, offset: KELVIN },
  { kind: "supply", name: "Supply of the chip", unit: "V", low: 0, high: 3.6, step: 0.05, start: 3.3, factor: 1 },
  { kind: "shaft", name: "Shaft", unit: "revolutions", low: -10, high: 10, step: 0.01, start: 0, factor: 1, rpm: true },
];

/** The power of the board: what a button says, and what the simulator takes. */
const POWER = [["Power off", "off"], ["Power on", "on"], ["Cut for 0.5 s", "off:0.5"]];

export class Board {
  constructor(bus, board, faults) {
    Object.assign(this, { bus, id: board.board, buttons: [] });
    this.result = outcome();
    this.quantities = QUANTITIES.map((quantity) => new Quantity(quantity, (kind, spec) => this.#send(kind, spec)));
    this.switches = new Map(faults.map((fault) => [fault.name, this.#fault(fault)]));
    this.buttons = board.buttons.map((_, at) => this.#button(at + 1));
    this.format = el("input", { type: "text", size: 24, title: "Turns + steps in bits, then gray or binary, error, even or odd" });
    const power = POWER.map(([name, spec]) => button(name, () => this.#send("power", spec)));
    this.title = el("legend");
    this.absolute = el("div", { class: "bar" }, field("Absolute encoder", this.format), button("Connect", () => this.#send("ssi", this.format.value)));
    this.panel = el("div", { class: "group", role: "group", "aria-label": "Buttons" }, this.buttons);
    this.element = el("fieldset", { class: "box board", data: { board: board.board } }, this.title, this.quantities.map(({ element }) => element),
      el("div", { class: "group", role: "group", "aria-label": "Power" }, power), this.absolute,
      el("fieldset", {}, el("legend", {}, "Faults"), el("div", { class: "switches" }, [...this.switches.values()].map(({ element }) => element))),
      this.panel, this.result.line);
    this.show(board);
  }

  show(board) {
    this.#showUsed(board);
    for (const quantity of this.quantities) if (board[quantity.kind]) quantity.show(board[quantity.kind]);
    if (document.activeElement !== this.format) this.format.value = board.ssi ?? "";
    for (const [name, { box }] of this.switches) box.checked = board.faults.includes(name);
  }

  /** Shows the controls of the inputs that the personality reads. A fault that is on stays in view. */
  #showUsed({ board, node, personality: configured, faults }) {
    const personality = this.bus.nodes.get(node)?.personality ?? configured;
    text(this.title, `Board ${board}${node == null ? "" : `: node ${node}, ${personality ?? "-"}`}`);
    for (const { kind, element } of this.quantities) set(element, "hidden", !reads(personality, kind));
    for (const [name, { element }] of this.switches) set(element, "hidden", !hasEffect(personality, name) && !faults.includes(name));
    set(this.absolute, "hidden", !reads(personality, "ssi"));
    set(this.panel, "hidden", !reads(personality, "button"));
  }

  #fault({ name, text }) {
    return toggle(name.replaceAll("-", " "), false, (on) => this.#request("fault", `${name}:${on ? "on" : "off"}`), { title: text });
  }

  /** A button is down while it is held, by mouse, finger or the space bar. */
  #button(number) {
    const send = (state) => this.#send("button", `${number}:${state}`);
    const element = button(`Button ${number}`, () => {});
    let isDown = false;
    const press = (down) => isDown !== down && ((isDown = down), send(down ? "down" : "up"));
    for (const name of ["pointerdown", "keydown"]) element.addEventListener(name, (event) => (event.key ?? " ") === " " && press(true));
    for (const name of ["pointerup", "pointerleave", "keyup", "blur"]) element.addEventListener(name, () => press(false));
    return element;
  }

  #send(kind, spec) {
    return this.#request(kind, spec).catch(() => {});
  }

  async #request(kind, spec) {
    const request = this.bus.request("stimulate", { board: this.id, kind, spec });
    this.result.clear();
    await request.catch((error) => this.result.bad(error));
    return request;
  }
}
