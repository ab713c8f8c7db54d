// Overview: the nodes on the bus, and their state.

import { button, el, set, text } from "../dom.js";
import { hex, percent, seconds } from "../format.js";
import { outcome } from "../outcome.js";

const COMMANDS = [["start", "Start"], ["stop", "Stop"], ["preop", "Pre-operational"], ["reset", "Reset"]];

export function overview(bus) {
  const rows = new Map();
  const body = el("tbody");
  const result = outcome();
  const empty = el("p", { class: "hint" }, "No node is heard yet.");
  const show = () => showNodes(bus, rows, body, result, empty);
  bus.on("nodes", show);
  bus.on("hello", show);
  const content = el("div", {}, tools(bus, result), result.line, empty, table(body));
  return { name: "overview", title: "Overview", content };
}

function tools(bus, result) {
  const scan = () => result.of("looking for nodes", bus.request("scan"), ({ found }) => (found.length ? `found ${found.join(", ")}` : "no node answers"));
  const all = COMMANDS.map(([command, label]) => button(`${label} all`, () => command_(bus, result, "all", command)));
  return el("div", { class: "bar" }, button("Scan", scan), el("div", { class: "group", role: "group", "aria-label": "All nodes" }, all));
}

/** Commands that end the work of a bus are confirmed where they go to all nodes. */
const ENDING = ["stop", "preop", "reset", "reset-communication"];

function command_(bus, result, node, command) {
  if (node === "all" && ENDING.includes(command) && !confirm(`Send "${command}" to all nodes?`)) return undefined;
  const who = node === "all" ? "all nodes" : `node ${node}`;
  const said = ({ state }) => `${who}: ${command}${state ? `, now ${state}` : ", sent"}`;
  return result.of(`${who}: ${command}`, bus.request("nmt", { node, command }), said);
}

const COLUMNS = ["Node", "Name", "Personality", "State", "EMCY", "Heartbeat", "Load", "Actions"];

function table(body) {
  const head = el("tr", {}, COLUMNS.map((name) => el("th", { scope: "col" }, name)));
  return el("div", { class: "wide" }, el("table", { class: "nodes cards" }, el("caption", { class: "unseen" }, "Nodes on the bus"), el("thead", {}, head), body));
}

function showNodes(bus, rows, body, result, empty) {
  const list = bus.list();
  set(empty, "hidden", list.length > 0);
  for (const [id, row] of rows) if (!bus.nodes.has(id)) (row.element.remove(), rows.delete(id));
  for (const [position, node] of list.entries()) {
    if (!rows.has(node.node)) rows.set(node.node, makeRow(bus, result, node.node));
    const row = rows.get(node.node);
    if (body.children[position] !== row.element) body.insertBefore(row.element, body.children[position] ?? null);
    fillRow(row, node);
  }
}

function makeRow(bus, result, id) {
  const cells = Object.fromEntries(COLUMNS.slice(1, -1).map((name) => [name, el("td", { data: { label: name } })]));
  const save = () => result.of(`node ${id}: saving`, bus.request("save", { node: id }), `node ${id}: all parameters saved`);
  const actions = [...COMMANDS.map(([command, label]) => button(label, () => command_(bus, result, id, command))), button("Save", save)];
  for (const action of actions) set(action, "aria-label", `${action.textContent} node ${id}`);
  const look = button(String(id), () => {
    bus.choose(id);
    location.hash = "live";
  }, { class: "plain", "aria-label": `Node ${id}: show its values` });
  const group = el("div", { class: "group", role: "group", "aria-label": `Node ${id}` }, actions);
  const element = el("tr", { data: { node: id } }, el("th", { scope: "row", data: { label: "Node" } }, look), Object.values(cells), el("td", { data: { label: "Actions" } }, group));
  return { element, cells };
}

function fillRow({ element, cells }, node) {
  set(element, "data-kind", node.alive ? null : "gone");
  text(cells.Name, node.name ?? (node.device_type == null ? "not identified yet" : `unknown device ${hex(node.device_type)}`));
  set(cells.Name, "title", `vendor ${hex(node.vendor)}, product ${hex(node.product)}, revision ${hex(node.revision)}, serial number ${hex(node.serial)}, software ${node.version ?? "-"}, hardware ${node.hardware ?? "-"}${node.note ? `; ${node.note}` : ""}`);
  text(cells.Personality, node.personality ?? "-");
  text(cells.State, stateOf(node));
  set(cells.State, "data-kind", node.alive && node.state === "operational" ? "good" : node.alive ? "warn" : "bad");
  text(cells.EMCY, node.emcy ? `${seconds(node.emcy.t, 1)}: ${node.emcy.text}` : "none");
  set(cells.EMCY, "data-kind", node.emcy?.active ? "bad" : "good");
  text(cells.Heartbeat, node.heartbeat == null ? "none" : seconds(node.heartbeat, 2));
  text(cells.Load, `${percent(node.load)}, ${node.frames}/s`);
}

function stateOf({ alive, state, updating, other_client }) {
  if (updating) return "updating";
  const shown = alive ? (state ?? "no heartbeat heard") : "not heard any more";
  return other_client ? `${shown}, another client is active` : shown;
}
