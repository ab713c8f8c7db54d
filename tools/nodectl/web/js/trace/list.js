// The list of the trace: the newest rows, one of which is chosen by mouse or by Up and Down.

import { el, set } from "../dom.js";
import { bytes, hex } from "../format.js";

/** The number of rows in the list. The browser cannot draw more in time on a full bus. */
const SHOWN = 400;

export class List {
  constructor(onChoose) {
    this.onChoose = onChoose;
    this.chosen = null;
    this.body = el("tbody");
    const head = ["Time s", "Δ ms", "CAN-ID", "Service", "Node", "DLC", "Data", "Content"].map((name) => el("th", { scope: "col" }, name));
    const table = el("table", { class: "frames list" }, el("caption", { class: "unseen" }, "Frames, the newest at the end"), el("thead", {}, el("tr", {}, head)), this.body);
    this.element = el("div", { class: "wide scroll", tabindex: 0, role: "group", "aria-label": "Frames", on: { keydown: (event) => this.#key(event) } }, table);
    this.body.addEventListener("click", (event) => this.#choose(event.target.closest("tr")));
  }

  append(rows) {
    const last = rows.slice(-SHOWN);
    this.body.append(...last.map(line));
    for (let excess = this.body.childElementCount - SHOWN; excess > 0; excess -= 1) this.body.firstChild.remove();
  }

  replace(rows) {
    this.body.replaceChildren();
    this.append(rows);
  }

  toEnd() {
    this.element.scrollTop = this.element.scrollHeight;
  }

  #key(event) {
    const step = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    if (!step) return;
    event.preventDefault();
    const from = this.chosen?.isConnected ? this.chosen[step] : this.body.lastElementChild;
    this.#choose(from);
  }

  #choose(element) {
    if (!element) return;
    set(this.chosen ?? element, "aria-selected", null);
    set(element, "aria-selected", "true");
    this.chosen = element;
    element.scrollIntoView({ block: "nearest" });
    this.onChoose(element.row);
  }
}

function line(row) {
  if (row.gap) return el("tr", { class: "gap" }, el("td", { colspan: 8 }, `${row.gap} rows were dropped here: the page was too slow`));
  const { t, id, kind, node, text, abort, delta, data = "" } = row;
  const shown = bytes(data);
  const element = el("tr", { data: { kind, ...(abort == null ? {} : { abort: "yes" }) } },
    el("td", { class: "number" }, t.toFixed(6)), el("td", { class: "number" }, delta == null ? "-" : (1000 * delta).toFixed(2)),
    el("td", {}, hex(id, 3)), el("td", {}, kind), el("td", {}, node ?? "-"), el("td", { class: "number" }, String(data.length / 2)),
    el("td", { class: "octets" }, shown.length > 23 ? `${shown.slice(0, 23)} …` : shown), el("td", {}, text));
  element.row = row;
  return element;
}
