// The details of one row of the trace: its bytes, their bits, and the values in them.

import { el } from "../dom.js";
import { address, bytes, hex, quantity, seconds } from "../format.js";

export function details(row) {
  if (!row || row.gap) return [el("p", { class: "hint" }, "Choose a frame for its bits and values.")];
  return [
    el("h3", {}, `${hex(row.id, 3)} ${row.kind}`),
    el("p", {}, `${seconds(row.t, 6)}${row.node == null ? "" : `, node ${row.node}`}${row.sent ? ", sent by this server" : ""}`),
    el("p", {}, row.text),
    bits(row.data ?? ""),
    values(row.values ?? []),
  ].filter(Boolean);
}

function bits(pairs) {
  const octets = bytes(pairs).split(" ").filter(Boolean);
  if (octets.length === 0 || octets.length > 8) return octets.length ? el("p", { class: "bytes" }, bytes(pairs)) : null;
  const rows = octets.map((octet, at) => {
    const all = Number.parseInt(octet, 16).toString(2).padStart(8, "0").split("");
    return el("tr", {}, el("th", { scope: "row" }, String(at)), el("td", {}, octet), all.map((bit) => el("td", { class: bit === "1" ? "bit one" : "bit" }, bit)));
  });
  const head = ["Byte", "Hex", 7, 6, 5, 4, 3, 2, 1, 0].map((name) => el("th", { scope: "col" }, String(name)));
  return el("table", { class: "bits" }, el("caption", {}, "Data, bit 7 first"), el("thead", {}, el("tr", {}, head)), el("tbody", {}, rows));
}

function values(list) {
  if (!list.length) return null;
  const rows = list.map(({ index, sub, name, value, unit, meaning }) =>
    el("tr", {}, el("th", { scope: "row" }, address(index, sub)), el("td", {}, name), el("td", { class: "number" }, quantity(value, unit)), el("td", {}, meaning ?? "")));
  const head = ["Object", "Name", "Value", "Meaning"].map((name) => el("th", { scope: "col" }, name));
  return el("table", {}, el("caption", {}, "Values"), el("thead", {}, el("tr", {}, head)), el("tbody", {}, rows));
}
