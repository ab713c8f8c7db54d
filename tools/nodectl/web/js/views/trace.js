// Trace: the meaning of every frame on the bus.

import { button, el, field, select, set, setChoices, text } from "../dom.js";
import { offer } from "../file.js";
import { hex } from "../format.js";
import { announce } from "../announce.js";
import { details } from "../trace/details.js";
import { ById } from "../trace/by_id.js";
import { List } from "../trace/list.js";
import { Filter, KINDS, Rows } from "../trace/rows.js";

export function trace(bus) {
  const view = new Trace(bus);
  return { name: "trace", title: "Trace", content: view.content, search: view.search, show: () => view.show(), hide: () => (view.isShown = false) };
}

class Trace {
  constructor(bus) {
    Object.assign(this, { bus, rows: new Rows(), filter: new Filter(), isPaused: false, waiting: [], isShown: false });
    const choose = (row) => this.details.replaceChildren(...details(row));
    this.list = new List(choose);
    this.byId = new ById(choose);
    this.details = el("aside", { class: "frame-details", "aria-label": "Details of the frame", "aria-live": "polite" }, ...details(null));
    this.count = el("p", { class: "hint" });
    this.search = el("input", { type: "search", placeholder: "words or CAN-ID", autocomplete: "off" });
    this.search.addEventListener("input", () => (this.filter.setText(this.search.value), this.#show()));
    this.content = this.#layout();
    bus.connection.on("trace", (event) => this.#take(event));
    bus.on("connected", () => this.isWanted && this.#ask());
    bus.on("nodes", () => this.#nodes());
  }

  /** Once this view was shown, the trace runs also while another view is shown, so that nothing is missing later. */
  show() {
    this.isShown = true;
    if (!this.isWanted) this.#ask();
    this.isWanted = true;
    this.#show();
  }

  #ask() {
    if (this.bus.connection.connected) this.bus.request("trace", { on: true }).catch((error) => announce(error.message));
  }

  #layout() {
    this.pause = button("Pause", () => this.#toggle(), { "aria-pressed": "false" });
    this.node = select([["", "all"]], "", (node) => ((this.filter.node = node), this.#show()));
    this.follow = el("input", { type: "checkbox", prop: { checked: true } });
    this.list.element.addEventListener("keydown", (event) => event.key === " " && (event.preventDefault(), this.#toggle()));
    this.isById = el("input", { type: "checkbox" });
    this.isById.addEventListener("change", () => {
      [this.list.element.hidden, this.byId.element.hidden] = [this.isById.checked, !this.isById.checked];
      this.#show();
    });
    const kinds = KINDS.map((kind) => this.#kind(kind));
    return el("div", {},
      el("div", { class: "bar" }, field("Search", this.search), field("Node", this.node), this.pause, el("label", {}, this.follow, " follow"), el("label", {}, this.isById, " by CAN-ID"),
        button("Clear", () => (this.rows.clear(), this.#show())), button("Save", () => this.#save())),
      el("fieldset", { class: "kinds" }, el("legend", {}, "Services"), kinds),
      this.count, el("div", { class: "split" }, this.list.element, this.byId.element, this.details));
  }

  #kind(kind) {
    const box = el("input", { type: "checkbox", prop: { checked: true } });
    box.addEventListener("change", () => {
      if (box.checked) this.filter.kinds.add(kind);
      else this.filter.kinds.delete(kind);
      this.#show();
    });
    return el("label", {}, box, ` ${kind}`);
  }

  #nodes() {
    setChoices(this.node, [["", "all"], ...this.bus.list().map(({ node }) => [String(node), String(node)])]);
  }

  #take(event) {
    this.waiting.push(...this.rows.take(event));
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => this.#append());
  }

  #append() {
    this.isAsked = false;
    if (!this.isPaused && this.isShown && this.isById.checked) {
      this.waiting = [];
      this.#showById();
    } else if (!this.isPaused && this.isShown) {
      this.list.append(this.waiting.filter((row) => this.filter.wants(row)));
      this.waiting = [];
      if (this.follow.checked) this.list.toEnd();
    } else if (!this.isPaused) this.waiting = [];
    this.#count();
  }

  #toggle() {
    this.isPaused = !this.isPaused;
    text(this.pause, this.isPaused ? "Continue" : "Pause");
    set(this.pause, "aria-pressed", String(this.isPaused));
    if (!this.isPaused) this.#show();
    else this.waiting = [];
    this.#count();
  }

  /** All kept rows that pass the filter. */
  #show() {
    this.waiting = [];
    if (this.isById.checked) this.#showById();
    this.list.replace(this.rows.rows.filter((row) => this.filter.wants(row)));
    if (this.follow.checked) this.list.toEnd();
    this.#count();
  }

  #showById() {
    this.byId.show(this.rows.byId, (row) => this.filter.wants(row));
  }

  #count() {
    const { number, lost, forgotten } = this.rows;
    const parts = [`${number} rows`, `${lost} dropped`];
    if (forgotten) parts.push(`${forgotten} older ones forgotten`);
    if (this.isPaused) parts.push(`paused, ${this.waiting.length} new`);
    text(this.count, parts.join(", "));
    set(this.count, "data-kind", lost ? "bad" : null);
  }

  #save() {
    const lines = this.rows.rows.filter((row) => this.filter.wants(row)).map((row) => (row.gap ? `${row.gap} rows were dropped here` : `${row.t.toFixed(6)} ${hex(row.id, 3)} ${row.kind} ${row.node ?? "-"} ${row.text}`));
    offer("trace.txt", lines.join("\n") + "\n");
  }
}
