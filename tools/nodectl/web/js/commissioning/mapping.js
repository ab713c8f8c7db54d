// PDO mapping: the PDOs of a node, and the change of one PDO in the five steps of CiA 301.

import { button, el, field, select, setChoices, text } from "../dom.js";
import { address, hex } from "../format.js";
import { outcome } from "../outcome.js";

const HEAD = ["PDO", "COB-ID", "Type", "Inhibit, 100 us", "Event, ms", "Objects"];
const STEPS = ["PDO off (bit 31 of its COB-ID)", "number of objects 0", "the objects", "their number", "PDO on"];
const SLOTS = 8;

export class Mapping {
  constructor(bus) {
    Object.assign(this, { bus, pdos: [], mappable: [] });
    this.result = outcome();
    this.list = el("tbody");
    this.steps = el("ol", { class: "steps", "aria-label": "The five steps" }, STEPS.map((step) => el("li", {}, step)));
    this.element = this.#layout();
  }

  async show() {
    const node = this.bus.chosen;
    const [{ pdos }, { entries }] = await Promise.all([this.bus.request("pdos", { node }), this.bus.request("dictionary", { node })]);
    this.pdos = pdos;
    this.entries = entries;
    this.#fillList();
    setChoices(this.choice, pdos.map((pdo, at) => [String(at), title(pdo)]));
    this.#edit();
  }

  /** Updates the list with changes by others. The PDO that the user edits stays unchanged. */
  async refresh() {
    const { pdos } = await this.bus.request("pdos", { node: this.bus.chosen });
    this.pdos = pdos;
    this.#fillList();
  }

  #layout() {
    this.choice = select([], null, () => this.#edit());
    this.slots = Array.from({ length: SLOTS }, () => select([["", "-"]], "", () => this.#countBits()));
    this.bits = el("p", { class: "hint", role: "status" });
    this.type = el("input", { type: "number", min: 0, max: 255 });
    this.event = el("input", { type: "number", min: 0, max: 65535 });
    this.inhibit = el("input", { type: "number", min: 0, max: 65535 });
    this.buttons = [button("Map", () => this.#map()), button("Switch off", () => this.#send({ objects: [] }))];
    this.numbers = [this.type, this.event, this.inhibit];
    const head = HEAD.map((name) => el("th", { scope: "col" }, name));
    const table = el("table", { class: "pdos cards" }, el("caption", { class: "unseen" }, "PDOs"), el("thead", {}, el("tr", {}, head)), this.list);
    return el("section", { class: "box", "aria-labelledby": "mapping-title" }, el("h3", { id: "mapping-title" }, "PDO mapping"),
      el("div", { class: "wide" }, table),
      el("div", { class: "bar" }, field("PDO", this.choice), field("Transmission type", this.type), field("Event timer, ms", this.event), field("Inhibit time, 100 us", this.inhibit)),
      el("div", { class: "slots" }, this.slots.map((slot, at) => field(`Object ${at + 1}`, slot))), this.bits,
      el("div", { class: "bar" }, this.buttons), this.steps, this.result.line);
  }

  #fillList() {
    this.list.replaceChildren(...this.pdos.map((pdo) => {
      const objects = pdo.objects.map(({ index, sub, name }) => `${address(index, sub)} ${name ?? ""}`).join(", ");
      const cells = [`${hex(pdo.cob_id & 0x7ff, 3)}${pdo.on ? "" : " off"}`, pdo.transmission, pdo.inhibit ?? "-", pdo.event ?? "-", objects || "-"];
      return el("tr", { data: { pdo: title(pdo), ...(pdo.on ? {} : { off: "yes" }) } }, el("th", { scope: "row" }, title(pdo)), cells.map((cell, at) => el("td", { data: { label: HEAD[at + 1] } }, String(cell))));
    }));
  }

  get #pdo() {
    return this.pdos[Number(this.choice.value)];
  }

  #edit() {
    const pdo = this.#pdo;
    if (!pdo) return;
    const choices = [["", "-"], ...this.entries.filter((entry) => entry[pdo.direction]).map((entry) => [`${entry.index}:${entry.sub}`, `${address(entry.index, entry.sub)} ${entry.name}`])];
    this.slots.forEach((slot, at) => {
      const object = pdo.objects[at];
      setChoices(slot, choices, "");
      slot.value = object ? `${object.index}:${object.sub}` : "";
    });
    this.type.value = pdo.transmission;
    this.event.value = pdo.event ?? 0;
    this.inhibit.value = pdo.inhibit ?? 0;
    const isFixed = this.#isFixed(pdo);
    for (const control of [...this.slots, ...this.numbers, ...this.buttons]) control.disabled = isFixed;
    this.#mark(0);
    this.#countBits();
    if (isFixed) text(this.bits, "The mapping of this PDO is fixed: the data sheet has no writable mapping parameter.");
  }

  #isFixed({ direction, number }) {
    const index = (direction === "tpdo" ? 0x1a00 : 0x1600) + number - 1;
    const entry = this.entries.find((entry) => entry.index === index && entry.sub === 0);
    return entry != null && !entry.access.includes("w");
  }

  #objects() {
    return this.slots.map(({ value }) => value).filter(Boolean).map((value) => value.split(":").map(Number));
  }

  #countBits() {
    const bits = this.#objects().reduce((sum, [index, sub]) => sum + bitsOf(this.entries.find((entry) => entry.index === index && entry.sub === sub)), 0);
    text(this.bits, `${bits} of 64 bits${bits > 64 ? ": too many" : ""}`);
  }

  #map() {
    const objects = this.#objects();
    if (objects.length === 0) return this.result.bad("Choose an object. \"Switch off\" ends the transmission of a PDO.");
    const wrong = this.numbers.find(({ validity, value }) => !validity.valid || value === "");
    if (wrong) return (wrong.focus(), this.result.bad(`${wrong.labels[0].innerText}: a whole number from ${wrong.min} to ${wrong.max}`));
    const [transmission, event, inhibit] = this.numbers.map(({ value }) => Number(value));
    return this.#send({ objects, transmission, event, ...(this.#pdo.direction === "tpdo" ? { inhibit } : {}) });
  }

  async #send(settings) {
    const { direction, number } = this.#pdo;
    const keys = { node: this.bus.chosen, direction, number, ...settings };
    this.#mark(0);
    const pdo = await this.result.of("mapping", this.bus.request("map", keys), (pdo) => `${title(pdo)}: ${pdo.objects.length} objects, ${pdo.bits} bits, ${pdo.on ? "on" : "off"}`);
    if (!pdo) return;
    this.pdos = this.pdos.map((old) => (old.direction === direction && old.number === number ? pdo : old));
    this.#fillList();
    this.#mark(settings.objects.length ? STEPS.length : 2);
  }

  /** Ticks off the steps that are done. */
  #mark(done) {
    [...this.steps.children].forEach((step, at) => (step.dataset.done = at < done ? "yes" : "no"));
  }
}

function title({ direction, number }) {
  return `${direction.toUpperCase()} ${number}`;
}

function bitsOf(entry) {
  const { type = "" } = entry ?? {};
  if (type === "BOOLEAN") return 1;
  return Number(/\d+$/.exec(type)?.[0] ?? 0);
}
