// One object of the dictionary: a line of the table, and its details below it when it is opened.

import { button, el, field, newId, set, text } from "../dom.js";
import { address, hex } from "../format.js";
import { outcome } from "../outcome.js";
import { check, isReadable, isWritable, rangeText } from "./check.js";
import { keyOf } from "./filter.js";
import { help } from "./help.js";

export class Row {
  kind = "object";

  /** `owner`: the view, with `read`, `write`, `arrange` and `favourites`. */
  constructor(entry, owner) {
    Object.assign(this, { entry, owner, key: keyOf(entry), details: null, made: null });
  }

  /** The line of the table. It is made when it comes into view for the first time. */
  get element() {
    this.made ??= this.#make();
    return this.made;
  }

  show(value) {
    this.newest = value;
    if (this.made) this.#fill();
  }

  /** Drops the value: the node may have another one now. */
  forget() {
    this.newest = undefined;
    if (this.made) this.#fill();
  }

  toggle() {
    if (this.details) return this.close();
    const id = newId("details");
    set(this.opener, "aria-expanded", "true");
    set(this.opener, "aria-controls", id);
    const element = el("tr", { id, class: "details" }, el("td", { colspan: 9 }, el("div", {}, this.#help(), this.#editor())));
    this.details = { kind: "details", element, made: element };
    this.owner.arrange();
    if (isReadable(this.entry)) this.#read();
  }

  close() {
    set(this.opener, "aria-expanded", "false");
    this.details = null;
    this.owner.arrange();
  }

  #make() {
    const { entry } = this;
    this.value = el("td", { class: "number", data: { label: "Value" } });
    this.unit = el("td", { data: { label: "Unit" } }, knownUnit(entry));
    this.opener = el("button", { type: "button", class: "plain", "aria-expanded": "false", on: { click: () => this.toggle() } }, address(entry.index, entry.sub));
    const element = el("tr", { class: "object", data: { object: address(entry.index, entry.sub) } }, el("td", {}, this.#star()), el("th", { scope: "row" }, this.opener), ...this.#cells());
    this.#fill();
    return element;
  }

  #fill() {
    const { newest: value, entry } = this;
    set(this.value, "class", value ? "number" : "number waiting");
    if (!value) return text(this.value, isReadable(entry) ? "…" : "write only");
    text(this.value, value.error ? "-" : shown(value));
    if (value.unit) text(this.unit, value.unit);
    return set(this.value, "title", value.error ?? `${shown(value)}${value.raw ? `, bytes ${value.raw}` : ""}`);
  }

  #cells() {
    const { path, type, access } = this.entry;
    const cell = (label, content) => el("td", { title: content, data: { label } }, content);
    return [cell("Name", path), this.value, this.unit, cell("Type", type), cell("Access", access), cell("Limits", this.#limits()), cell("Default", this.#default())];
  }

  #limits() {
    const { low, high } = this.entry;
    return low == null && high == null ? "" : rangeText(this.entry);
  }

  #default() {
    const { default: value, type } = this.entry;
    if (value == null) return "";
    return typeof value === "number" && value > 0xffff && /^UNSIGNED/.test(type) ? hex(value, 8) : String(value);
  }

  #star() {
    const { favourites } = this.owner;
    const star = button("", () => (favourites.toggle(this.key), show()), { class: "star", "aria-label": `Favourite ${this.entry.path}` });
    const show = () => {
      text(star, favourites.has(this.key) ? "★" : "☆");
      set(star, "aria-pressed", String(favourites.has(this.key)));
    };
    show();
    return star;
  }

  #help() {
    const { type, access, tpdo, rpdo, parameter } = this.entry;
    const words = help(this.entry, this.owner.bus.node()?.personality);
    const pdo = [tpdo && "TPDO", rpdo && "RPDO"].filter(Boolean).join(" and ");
    const facts = [type, access, rangeText(this.entry), pdo && `can be in a ${pdo}`, parameter && "part of a configuration"];
    return [words ? el("p", {}, words) : null, el("p", { class: "hint" }, facts.filter(Boolean).join(" · "))].filter(Boolean);
  }

  #editor() {
    this.result = outcome();
    const read = isReadable(this.entry) && button("Read", () => this.#read());
    if (!isWritable(this.entry)) return el("div", { class: "bar" }, read, this.result.line);
    this.input = el("input", { autocomplete: "off", spellcheck: "false" });
    const form = el("form", { class: "bar", novalidate: true }, field("New value", this.input), el("button", { type: "submit" }, "Write"), read);
    form.addEventListener("submit", (event) => (event.preventDefault(), this.#write()));
    return el("div", {}, form, this.result.line);
  }

  async #read() {
    const value = await this.result.of("reading", this.owner.read(this.entry), (value) => value.error ?? (value.meaning ? `reads ${value.text}: ${value.meaning}` : ""));
    if (!value) return;
    if (value.error) this.result.bad(value.error);
    else if (this.input && this.input.value === "" && document.activeElement !== this.input) this.input.value = value.text;
  }

  async #write() {
    const wrong = check(this.entry, this.input.value);
    set(this.input, "aria-invalid", wrong ? "true" : null);
    if (wrong) return this.result.bad(wrong);
    const said = (value) => (value?.text == null ? "written" : `written, reads ${shown(value)}`);
    const value = await this.result.of("writing", this.owner.write(this.entry, this.input.value.trim()), said);
    set(this.input, "aria-invalid", value ? null : "true");
  }
}

/** The unit in the data sheet. Where the data sheet names the object with the unit (6131h), a read brings the unit. */
function knownUnit({ unit }) {
  return /^[0-9A-F]{4}h/.test(unit) ? "" : unit;
}

/** A value with its meaning. The unit has a column of its own where the data sheet has a unit. */
function shown({ text: value, meaning }) {
  const known = value ?? "";
  return meaning ? `${known} (${meaning})` : known;
}
