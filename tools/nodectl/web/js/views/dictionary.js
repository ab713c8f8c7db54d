// Dictionary: every object of a node, to find, read and write.

import { button, el, field, select, set, text } from "../dom.js";
import { dcfTools } from "../dictionary/dcf.js";
import { Favourites } from "../dictionary/favourites.js";
import { isIn, keyOf, matches, SETS } from "../dictionary/filter.js";
import { Row } from "../dictionary/row.js";
import { outcome } from "../outcome.js";
import { nodeChoice } from "../parts/node_choice.js";

const COLUMNS = ["", "Object", "Name", "Value", "Unit", "Type", "Access", "Limits", "Default"];

export function dictionary(bus) {
  const view = new Dictionary(bus);
  return { name: "dictionary", title: "Dictionary", content: view.content, search: view.search, show: () => view.show(), hide: () => (view.isShown = false) };
}

class Dictionary {
  constructor(bus) {
    Object.assign(this, { bus, favourites: new Favourites(), differing: new Set(), rows: [], values: new Map(), set: "all", node: null });
    this.result = outcome();
    this.count = el("p", { class: "hint", role: "status" });
    this.body = el("tbody");
    this.search = el("input", { type: "search", placeholder: "name or index", autocomplete: "off", on: { input: () => this.#filter() } });
    this.content = this.#layout();
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
    const { values: [value] } = await this.bus.request("read", { node: this.node, objects: [[entry.index, entry.sub]] });
    this.#keep(value);
    return value;
  }

  async write({ index, sub }, value) {
    const written = await this.bus.request("write", { node: this.node, index, sub, value });
    if (written?.text != null) this.#keep(written);
    return written;
  }

  #layout() {
    const choice = select(SETS, "all", (value) => this.#choose(value));
    const head = COLUMNS.map((name) => el("th", { scope: "col" }, name || el("span", { class: "unseen" }, "Favourite")));
    const table = el("table", { class: "objects cards" }, el("caption", { class: "unseen" }, "Object dictionary"), el("thead", {}, el("tr", {}, head)), this.body);
    return el("div", {},
      el("div", { class: "bar" }, nodeChoice(this.bus), field("Search", this.search), field("Show", choice), button("Read all values", () => this.#readAll())),
      dcfTools(this.bus, () => this.#readAll()), this.result.line, this.count, el("div", { class: "wide" }, table));
  }

  #take({ data_sheet, entries }) {
    this.values.clear();
    this.differing.clear();
    for (const row of this.rows) row.remove();
    this.rows = entries.map((entry) => new Row(entry, this));
    this.byKey = new Map(this.rows.map((row) => [row.key, row]));
    this.body.replaceChildren(...this.rows.map(({ element }) => element));
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
    let shown = 0;
    for (const row of this.rows) {
      const isShown = isIn(row.entry, this.set, this) && matches(row.entry, this.search.value);
      set(row.element, "hidden", !isShown);
      if (!isShown) row.close();
      shown += isShown;
    }
    text(this.count, `${shown} of ${this.rows.length} objects`);
  }

  #readAll() {
    const progress = ({ done, all, values }) => {
      this.result.busy(`read ${done} of ${all}`);
      for (const value of values) this.#keep(value);
    };
    return this.result.of("reading", this.bus.request("values", { node: this.node }, progress), ({ read }) => `${read} objects read`);
  }

  #keep(value) {
    this.values.set(keyOf(value), value);
    this.byKey.get(keyOf(value))?.show(value);
  }
}
