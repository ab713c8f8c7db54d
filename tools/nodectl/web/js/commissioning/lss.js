// LSS: nodes without a node-ID, node-IDs, the bit rate.

import { button, el, field, select, set } from "../dom.js";
import { hex } from "../format.js";
import { outcome } from "../outcome.js";

const RATES = [1000, 800, 500, 250, 125, 50, 20, 10];

export function lss(bus) {
  const found = { identity: null };
  return el("section", { class: "box", "aria-labelledby": "lss-title" }, el("h3", { id: "lss-title" }, "LSS: node-ID and bit rate"), search(bus, found), rate(bus));
}

function search(bus, found) {
  const result = outcome();
  const id = el("input", { type: "number", min: 1, max: 127, value: 1 });
  const store = el("input", { type: "checkbox", prop: { checked: true } });
  const assign = button("Give the node-ID", () => give(), { disabled: true });
  const progress = ({ done, all }) => result.busy(`step ${done} of ${all}`);
  const scan = async () => {
    const answer = await result.of("looking for a node without a node-ID", bus.request("lss.scan", {}, progress), ({ found }) => (found ? `found ${words(found)}` : "no node without a node-ID"));
    found.identity = answer?.found ?? null;
    set(assign, "disabled", found.identity == null);
    id.value = freeId(bus);
  };
  const give = async () => {
    const keys = { identity: found.identity, node_id: Number(id.value), store: store.checked };
    const answer = await result.of("assigning", bus.request("lss.assign", keys), ({ node }) => `node ${node} is there`);
    if (answer) set(assign, "disabled", true);
  };
  return el("div", {}, el("div", { class: "bar" }, button("Find a node without a node-ID", scan), field("Node-ID", id), el("label", {}, store, " store"), assign), result.line);
}

function rate(bus) {
  const result = outcome();
  let kbit = 250;
  const rates = select(RATES.map((rate) => [rate, `${rate} kbit/s`]), kbit, (value) => (kbit = Number(value)));
  const change = () => {
    if (!confirm(`Change the bit rate of all nodes to ${kbit} kbit/s? The interface of this computer has to be changed too.`)) return;
    return result.of("changing", bus.request("lss.bit_rate", { kbit, identity: null, store: true, activate: 1000 }), `${kbit} kbit/s: stored, and in force`);
  };
  return el("div", {}, el("div", { class: "bar" }, field("Bit rate of all nodes", rates), button("Change the bit rate", change)), result.line);
}

function words({ vendor, product, revision, serial }) {
  return `vendor ${hex(vendor)}, product ${hex(product)}, revision ${hex(revision)}, serial number ${hex(serial)}`;
}

function freeId(bus) {
  for (let id = 1; id < 128; id += 1) if (!bus.nodes.has(id)) return id;
  return 127;
}
