// The lift: the car in its shaft, the load, the calls and the lamps of the panel.

import { el, field, set, svg, text } from "../dom.js";
import { quantity, signalKey } from "../format.js";
import { outcome } from "../outcome.js";
import { readAll, write } from "../parts/objects.js";
import { toggle } from "../parts/switch.js";

const [DEVICES, LAMPS, LOAD, CALL, POSITION] = [0x2305, 0x2322, 0x2313, 0x6010, 0x6383];
const NAMES = ["Car position unit", "Load measuring unit", "Input panel", "Output panel"];
const LIT = 1;

export class Lift {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder, least: Infinity, greatest: -Infinity });
    this.car = svg("rect", { x: 30, width: 60, height: 36, rx: 3, class: "car" });
    this.shaft = svg("svg", { viewBox: "0 0 120 300", class: "shaft", role: "img" }, svg("rect", { x: 24, y: 4, width: 72, height: 292, class: "rim" }), this.car);
    this.position = el("output", { class: "big" }, "-");
    this.load = el("output", {}, "-");
    this.call = el("output", {}, "-");
    this.result = outcome();
    this.devices = el("fieldset", {}, el("legend", {}, "Virtual devices of this node (2305h)"));
    this.lamps = el("fieldset", {}, el("legend", {}, "Lamps (2322h)"));
    this.element = el("section", { class: "box", "aria-labelledby": "lift-title" }, el("h3", { id: "lift-title" }, "Lift"), this.devices,
      el("div", { class: "split" }, this.shaft, el("div", {}, field("Car", this.position), field("Load", this.load), field("Last call (6010h)", this.call), this.lamps)), this.result.line);
  }

  static isFor(personality) {
    return personality === "lift";
  }

  get keys() {
    return [[POSITION, 1], [LOAD, 1], [CALL, 0]].map(([index, sub]) => signalKey(this.bus.chosen, index, sub));
  }

  async show() {
    const [devices, ...lamps] = await readAll(this.bus, [[DEVICES, 0], [LAMPS, 1], [LAMPS, 2]]);
    this.chosen = devices;
    const choices = NAMES.map((name, bit) => toggle(name, ((devices >> bit) & 1) === 1, (on) => this.#choose(bit, on)).element);
    this.devices.replaceChildren(this.devices.firstChild, ...choices);
    const switches = lamps.map((lamp, at) => toggle(`Lamp ${at + 1}`, lamp > 0, (on) => this.#send(LAMPS, at + 1, on ? LIT : 0, `lamp ${at + 1} ${on ? "lit" : "out"}`)).element);
    this.lamps.replaceChildren(this.lamps.firstChild, ...switches);
  }

  draw() {
    const [position, load, call] = this.keys.map((key) => this.#shown(key));
    text(this.position, position);
    text(this.load, load);
    text(this.call, call);
    this.#drawCar(this.recorder.of(this.keys[0]).newest);
  }

  /** The shaft spans the positions that the car has had so far. */
  #drawCar(position) {
    if (typeof position !== "number") return;
    this.least = Math.min(this.least, position);
    this.greatest = Math.max(this.greatest, position);
    const height = this.greatest - this.least || 1;
    set(this.car, "y", (256 - ((position - this.least) / height) * 248).toFixed(1));
    set(this.shaft, "aria-label", `The car is at ${this.position.textContent}`);
  }

  #shown(key) {
    const { newest } = this.recorder.of(key);
    return newest === undefined ? "-" : quantity(newest, this.recorder.signals.get(key)?.unit);
  }

  async #choose(bit, on) {
    const devices = on ? this.chosen | (1 << bit) : this.chosen & ~(1 << bit);
    await this.#send(DEVICES, 0, devices, `${NAMES[bit]} ${on ? "chosen" : "not chosen"}`);
    this.chosen = devices;
  }

  /** The promise fails when the request fails, so that a switch goes back. */
  async #send(index, sub, value, done) {
    const request = write(this.bus, index, sub, value);
    await this.result.of("writing", request, done);
    await request;
  }
}
