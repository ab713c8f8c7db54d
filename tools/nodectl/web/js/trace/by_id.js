// The trace by CAN-ID: one row for each, with count, period and newest content.

import { el } from "../dom.js";
import { bytes, hex } from "../format.js";

const HEAD = ["CAN-ID", "Service", "Node", "Rows", "Period ms", "Shortest", "Longest", "DLC", "Data", "Content"];

export class ById {
  constructor(onChoose) {
    this.body = el("tbody");
    const head = HEAD.map((name) => el("th", { scope: "col" }, name));
    const caption = el("caption", {}, "A transfer of several frames, and a heartbeat whose state is new, are one row");
    const table = el("table", { class: "frames by-id" }, caption, el("thead", {}, el("tr", {}, head)), this.body);
    this.element = el("div", { class: "wide scroll", tabindex: 0, role: "group", "aria-label": "Frames by CAN-ID", prop: { hidden: true } }, table);
    this.body.addEventListener("click", (event) => onChoose(event.target.closest("tr")?.row ?? null));
  }

  show(byId, wants) {
    const all = [...byId].filter(([, { row }]) => wants(row)).sort(([a], [b]) => a - b);
    this.body.replaceChildren(...all.map(([id, counted]) => line(id, counted)));
  }
}

function line(id, { first, shortest, longest, count, row }) {
  const time = (label, seconds) => el("td", { class: "number", data: { label } }, count > 1 ? (1000 * seconds).toFixed(2) : "-");
  const data = row.data ?? "";
  const element = el("tr", { data: { kind: row.kind } },
    el("th", { scope: "row" }, hex(id, 3)), el("td", {}, row.kind), el("td", {}, row.node ?? "-"), el("td", { class: "number", data: { label: "rows" } }, String(count)),
    time("period", (row.t - first) / Math.max(1, count - 1)), time("min", shortest), time("max", longest),
    el("td", { class: "number" }, String(data.length / 2)), el("td", { class: "octets" }, bytes(data).slice(0, 23)), el("td", {}, row.text));
  element.row = row;
  return element;
}
