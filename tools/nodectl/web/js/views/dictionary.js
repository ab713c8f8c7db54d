// Dictionary: every object of a node, to find, read and write.

import { button, el, field, select, set, text } from "../dom.js";
import { Area, AREAS } from "../dictionary/areas.js";
import { dcfTools } from "../dictionary/dcf.js";
import { Favourites } from "../dictionary/favourites.js";
import { isIn, keyOf, matches, SETS } from "../dictionary/filter.js";
import { Reader } from "../dictionary/reader.js";
import { Row } from "../dictionary/row.js";
import { VirtualRows } from "../dictionary/virtual.js";
import { outcome } from "../outcome.js";
import { nodeChoice } from "../parts/node_choice.js";

const COLUMNS = ["", "Object", "Name", "Value", "Unit", "Type", "Access", "Limits", "Default"];

export function dictionary(bus) {
  const view = new Dictionary(bus);
  return { name: "dictionary", title: "Dictionary", content: view.content, search: view.search, show: () => view.show(), hide: () => (view.isShown = false) };
}

class Dictionary {
  constructor(bus) {
    Object.assign(this, { bus, favourites: new Favourites(), differing: new Set(), rows: [], byKey: new Map(), shown: [], set: "all", node: null });
    this.areas = AREAS.map((area) => new Area(area, () => this.arrange()));
    this.result = outcome();
    this.count = el("p", { class: "hint", role: "status" });
    this.body = el("tbody");
    this.reason = el("p", { class: "hint" });
    this.search = el("input", { type: "search", placeholder: "name or index", autocomplete: "off", on: { input: () => this.#filter() } });
    this.content = this.#layout();
    this.list = new VirtualRows(this.box, this.body, (items) => this.reader.look(items.filter(({ kind }) => kind === "object")));
    this.reader = new Reader(bus, { read: (entries) => this.#readThese(entries), isShown: () => this.isShown, onReason: (reason) => this.#explain(reason) });
    bus.on("chosen", () => this.show());
    bus.on("connected", () => this.show());
  }

  /** Loads the dictionary of the chosen node, if another one is shown. */
  async show() {
    this.isShown ||= !this.content.closest("section")?.hidden;
    const { bus } = this;
    if (!this.isShown || bus.chosen == null || bus.chosen === this.node || !bus.connection.connected) return;
    const node = bus.chosen;
    this.node = node;
    const answer = await this.result.of("loading", bus.request("dictionary", { node }), "");
    if (!answer) this.node = null;
    else if (this.node === node) this.#take(answer);
  }

  async read(entry) {
    const [value] = await this.#readThese([entry]);
    return value;
  }

  async #readThese(entries) {
    const { node } = this;
    const { values } = await this.bus.request("read", { node, objects: entries.map(({ index, sub }) => [index, sub]) });
    if (node === this.node) values.forEach((value) => this.#keep(value));
    return values;
  }

  async write({ index, sub }, value) {
    const written = await this.bus.request("write", { node: this.node, index, sub, value });
    if (written?.text != null) this.#keep(written);
    return written;
  }

  #layout() {
    const choice = select(SETS, "all", (value) => this.#choose(value));
    const head = COLUMNS.map((name) => el("th", { scope: "col" }, name || el("span", { class: "unseen" }, "Favourite")));
    this.table = el("table", { class: "objects cards" }, el("caption", { class: "unseen" }, "Object dictionary"), el("thead", {}, el("tr", {}, head)), this.body);
    this.box = el("div", { class: "listing", tabindex: 0, role: "group", "aria-label": "Objects" }, this.table);
    return el("div", {},
      el("div", { class: "bar" }, nodeChoice(this.bus), field("Search", this.search), field("Show", choice), button("Read all values", () => this.#readAll())),
      dcfTools(this.bus, () => this.#forget()), el("div", { class: "counts" }, this.count, this.reason, this.result.line), this.box);
  }

  #explain(reason) {
    text(this.reason, reason ? `Values are not read: ${reason}.` : "Values are read as they come into view.");
    set(this.reason, "data-kind", reason ? "warn" : null);
  }

  #take({ data_sheet, entries }) {
    this.differing.clear();
    this.reader.restart();
    this.rows = entries.map((entry) => new Row(entry, this));
    this.byKey = new Map(this.rows.map((row) => [row.key, row]));
    if (!data_sheet) this.result.good("No data sheet of this device is known: only the objects of CiA 301 are listed.");
    this.#filter();
  }

  async #choose(choice) {
    this.set = choice;
    if (choice === "differs") await this.#compare();
    this.#filter();
  }

  async #compare() {
    const progress = ({ done, all }) => this.result.busy(`compared ${done} of ${all}`);
    const said = ({ differences }) => `${differences.length} objects differ from the default`;
    const answer = await this.result.of("comparing", this.bus.request("differences", { node: this.node }, progress), said);
    this.differing = new Set(answer?.differences.map(keyOf));
    for (const difference of answer?.differences ?? []) this.#keep({ ...difference, text: String(difference.value) });
  }

  #filter() {
    this.shown = this.rows.filter(({ entry }) => isIn(entry, this.set, this) && matches(entry, this.search.value));
    text(this.count, `${this.shown.length} of ${this.rows.length} objects.`);
    this.box.scrollTop = 0;
    this.arrange();
  }

  /** Puts the shown objects below the headings of their areas, and the open details below their objects. */
  arrange() {
    const items = this.areas.flatMap((area) => {
      const rows = this.shown.filter(({ entry }) => area.has(entry));
      area.show(rows.length);
      const isOpen = area.isOpen || this.search.value !== "";
      return rows.length ? [area, ...(isOpen ? rows.flatMap((row) => (row.details ? [row, row.details] : [row])) : [])] : [];
    });
    set(this.table, "aria-rowcount", items.length + 1);
    this.list.show(items);
  }

  /** A configuration was written: all values are read again. */
  #forget() {
    for (const row of this.rows) row.forget();
    this.arrange();
  }

  #readAll() {
    const progress = ({ done, all, values }) => {
      this.result.busy(`read ${done} of ${all}`);
      for (const value of values) this.#keep(value);
    };
    return this.result.of("reading", this.bus.request("values", { node: this.node }, progress), ({ read }) => `${read} objects read`);
  }

  #keep(value) {
    this.byKey.get(keyOf(value))?.show(value);
  }
}
