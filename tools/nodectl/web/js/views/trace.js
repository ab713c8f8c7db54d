// Trace: the meaning of every frame on the bus.

import { button, el, field, select, set, setChoices, text } from "../dom.js";
import { offer } from "../file.js";
import { hex } from "../format.js";
import { announce } from "../announce.js";
import { details } from "../trace/details.js";
import { List } from "../trace/list.js";
import { Filter, KINDS, Rows } from "../trace/rows.js";

export function trace(bus) {
  const view = new Trace(bus);
  return { name: "trace", title: "Trace", content: view.content, search: view.search, show: () => view.show(), hide: () => (view.isShown = false) };
}

class Trace {
  constructor(bus) {
    Object.assign(this, { bus, rows: new Rows(), filter: new Filter(), isPaused: false, waiting: [], isShown: false });
    this.list = new List((row) => this.details.replaceChildren(...details(row)));
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
    const kinds = KINDS.map((kind) => this.#kind(kind));
    return el("div", {},
      el("div", { class: "bar" }, field("Search", this.search), field("Node", this.node), this.pause, el("label", {}, this.follow, " follow"),
        button("Clear", () => (this.rows.clear(), this.#show())), button("Save", () => this.#save())),
      el("fieldset", { class: "kinds" }, el("legend", {}, "Services"), kinds),
      this.count, el("div", { class: "split" }, this.list.element, this.details));
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
    if (!this.isPaused && this.isShown) {
      this.list.append(this.waiting.filter((row) => this.filter.wants(row)));
      this.waiting = [];
      if (this.follow.checked) this.list.toEnd();
    } else if (!this.isPaused) this.waiting = [];
    this.#count();
  }

  #toggle() {
    this.isPaused = !this.isPaused;
    text(this.pause, this.isPaused ? "Go on" : "Pause");
    set(this.pause, "aria-pressed", String(this.isPaused));
    if (!this.isPaused) this.#show();
    else this.waiting = [];
    this.#count();
  }

  /** All kept rows that pass the filter. */
  #show() {
    this.waiting = [];
    this.list.replace(this.rows.rows.filter((row) => this.filter.wants(row)));
    if (this.follow.checked) this.list.toEnd();
    this.#count();
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
