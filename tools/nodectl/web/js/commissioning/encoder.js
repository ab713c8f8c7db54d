// An encoder: preset, and the cams on a dial.

import { button, el, field, select, svg, text } from "../dom.js";
import { number, signalKey } from "../format.js";
import { outcome } from "../outcome.js";
import { Edits, objectField, readAll, write } from "../parts/objects.js";
import { arc, point } from "./dial.js";

const CAMS = 8;
const COLUMNS = ["On", "Inverted", "Low", "High", "Hysteresis"];
const [UNITS, RANGE, PRESET, POSITION] = [0x6001, 0x6002, 0x6003, 0x6004];
const [STATES, ENABLES, POLARITIES, LOW, HIGH, HYSTERESIS] = [0x6300, 0x6301, 0x6302, 0x6310, 0x6320, 0x6330];

export class Encoder {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder, cams: [], turn: 1, scale: "turn" });
    this.position = el("output", { class: "big" }, "-");
    this.preset = objectField(bus, "Preset", PRESET, 0, "The position now becomes this value.");
    this.edits = new Edits(bus);
    this.result = outcome();
    this.rows = Array.from({ length: CAMS }, (_, at) => this.#row(at));
    this.writing = button("Write the cams", () => this.#write());
    this.needle = svg("line", { x1: 110, y1: 110, class: "needle" });
    this.arcs = svg("g");
    this.dial = svg("svg", { viewBox: "0 0 220 220", class: "dial", role: "img" }, svg("circle", { cx: 110, cy: 110, r: 100, class: "rim" }), this.arcs, this.needle);
    this.element = this.#layout();
  }

  static isFor(personality) {
    return personality === "encoder" || personality === "combined";
  }

  get keys() {
    return [signalKey(this.bus.chosen, POSITION, 0), signalKey(this.bus.chosen, STATES, 1)];
  }

  async show() {
    await this.preset.show();
    await this.#readCams();
  }

  draw() {
    const [position, states] = this.keys.map((key) => this.recorder.of(key).newest);
    if (position == null) return;
    text(this.position, `${number(position)} units`);
    const [x, y] = point(this.#angle(position), 96);
    this.needle.setAttribute("x2", x);
    this.needle.setAttribute("y2", y);
    this.#drawArcs(states ?? 0);
    this.dial.setAttribute("aria-label", `Position ${number(position)}, cams on: ${this.#on(states ?? 0) || "none"}`);
  }

  #layout() {
    const scale = select([["turn", "one revolution"], ["range", "the whole range"]], "turn", (value) => ((this.scale = value), this.draw()));
    const head = ["Cam", ...COLUMNS].map((name) => el("th", { scope: "col" }, name));
    const table = el("table", { class: "cams cards" }, el("caption", { class: "unseen" }, "Cams of channel 1"), el("thead", {}, el("tr", {}, head)), el("tbody", {}, this.rows.map(({ element }) => element)));
    return el("section", { class: "box", "aria-labelledby": "encoder-title" }, el("h3", { id: "encoder-title" }, "Encoder"),
      el("div", { class: "bar" }, this.position), this.preset.element, el("h4", {}, "Cams of channel 1"),
      el("div", { class: "split" }, el("div", {}, this.dial, field("Dial", scale)), el("div", { class: "wide" }, table)), el("div", { class: "bar" }, this.writing), this.result.line);
  }

  async #readCams() {
    if (this.shown !== this.bus.chosen) this.#enable(false);
    const limits = Array.from({ length: CAMS }, (_, cam) => [LOW, HIGH, HYSTERESIS].map((first) => [first + cam, 1])).flat();
    const read = () => readAll(this.bus, [[UNITS, 0], [RANGE, 0], [ENABLES, 1], [POLARITIES, 1], ...limits]);
    const answer = await this.edits.around(read);
    if (!answer) return;
    const [turn, range, enables, polarities, ...values] = answer;
    this.shown = this.bus.chosen;
    Object.assign(this, { turn, range });
    this.cams = Array.from({ length: CAMS }, (_, cam) => ({ on: (enables >> cam) & 1, inverted: (polarities >> cam) & 1, low: values[3 * cam], high: values[3 * cam + 1], hysteresis: values[3 * cam + 2] }));
    this.#showRows();
    this.draw();
  }

  /** The controls of one cam. They are kept after a read, so that a control in use keeps the focus. */
  #row(at) {
    const control = (name, type, edited) => el("input", { type, disabled: true, "aria-label": `Cam ${at + 1} ${name}`, on: { input: ({ target }) => this.#edit(at, name, edited(target)) } });
    const boxes = ["on", "inverted"].map((name) => [name, control(name, "checkbox", ({ checked }) => Number(checked))]);
    const limits = ["low", "high", "hysteresis"].map((name) => [name, control(name, "number", ({ value }) => Number(value))]);
    const cells = [...boxes, ...limits].map(([, input], column) => el("td", { "data-label": COLUMNS[column] }, input));
    return { element: el("tr", {}, el("th", { scope: "row" }, String(at + 1)), cells), boxes, limits };
  }

  #showRows() {
    for (const [at, { boxes, limits }] of this.rows.entries()) {
      for (const [name, box] of boxes) box.checked = this.cams[at][name] === 1;
      for (const [name, limit] of limits) limit.value = this.cams[at][name];
    }
    this.#enable(true);
  }

  /** Nothing is written to a node whose cams have not been read. */
  #enable(on) {
    this.writing.disabled = !on;
    for (const { boxes, limits } of this.rows) for (const [, input] of [...boxes, ...limits]) input.disabled = !on;
  }

  #edit(at, name, value) {
    this.edits.begin();
    this.cams[at][name] = value;
    this.draw();
  }

  #write() {
    return this.result.of("writing", this.#writeAll(), "cams written; save them in the overview");
  }

  async #writeAll() {
    for (const [at, cam] of this.cams.entries()) {
      for (const [first, name] of [[LOW, "low"], [HIGH, "high"], [HYSTERESIS, "hysteresis"]]) await write(this.bus, first + at, 1, cam[name]);
    }
    const mask = (name) => this.cams.reduce((bits, cam, at) => bits | (cam[name] << at), 0);
    await write(this.bus, POLARITIES, 1, mask("inverted"));
    await write(this.bus, ENABLES, 1, mask("on"));
    this.edits.end();
  }

  #angle(position) {
    const whole = this.scale === "turn" ? this.turn : this.range;
    return ((position % whole) / whole) * 360;
  }

  #drawArcs(states) {
    const arcs = this.cams.map((cam, at) => (cam.on ? svg("path", { d: arc(this.#angle(cam.low), this.#angle(cam.high), 92 - at * 8), class: "cam", "data-on": (states >> at) & 1 ? "yes" : null }) : null));
    this.arcs.replaceChildren(...arcs.filter(Boolean));
  }

  #on(states) {
    return this.cams.map((_, at) => at + 1).filter((cam) => (states >> (cam - 1)) & 1).join(", ");
  }
}
