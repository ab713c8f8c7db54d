// Overview: the bus and its statistics, the nodes, and their state.

import { button, el, field, select, set, text } from "../dom.js";
import { outcome } from "../outcome.js";
import { events } from "../overview/events.js";
import { isWanted, SETS, summary } from "../overview/filter.js";
import { COLUMNS, Row } from "../overview/row.js";
import { statistics } from "../overview/statistics.js";

const COMMANDS = [["start", "Start"], ["stop", "Stop"], ["preop", "Pre-operational"], ["reset", "Reset"]];

/** Commands that end the work of a bus are confirmed where they go to all nodes. */
const ENDING = ["stop", "preop", "reset", "reset-communication"];

export function overview(bus) {
  const view = new Overview(bus);
  return { name: "overview", title: "Overview", content: view.content, search: view.search };
}

class Overview {
  constructor(bus) {
    Object.assign(this, { bus, commands: COMMANDS, rows: new Map(), set: "all" });
    this.body = el("tbody");
    this.result = outcome();
    this.count = el("p", { class: "hint", role: "status" });
    this.search = el("input", { type: "search", placeholder: "node-ID, name or state", autocomplete: "off", on: { input: () => this.#show() } });
    this.content = this.#layout();
    bus.on("nodes", () => this.#show());
    bus.on("hello", () => this.#show());
    bus.on("connected", () => bus.connection.connected && this.result.clear());
    this.#show();
  }

  command(node, command) {
    if (node === "all" && ENDING.includes(command) && !confirm(`Send "${command}" to all nodes?`)) return undefined;
    const who = node === "all" ? "all nodes" : `node ${node}`;
    const said = ({ state }) => `${who}: ${command}${state ? `, now ${state}` : ", sent"}`;
    return this.result.of(`${who}: ${command}`, this.bus.request("nmt", { node, command }), said);
  }

  save(node) {
    return this.result.of(`node ${node}: saving`, this.bus.request("save", { node }), `node ${node}: all parameters saved`);
  }

  #layout() {
    const head = el("tr", {}, COLUMNS.map((name) => el("th", { scope: "col" }, name)));
    const table = el("table", { class: "nodes cards" }, el("caption", { class: "unseen" }, "Nodes on the bus"), el("thead", {}, head), this.body);
    this.list = el("div", { class: "listing", tabindex: 0, role: "group", "aria-label": "Nodes" }, table);
    return el("div", {}, statistics(this.bus), this.#tools(), this.result.line, this.count, this.list, el("h3", {}, "Events"), events(this.bus));
  }

  #tools() {
    const found = ({ found }) => (found.length ? `found ${found.join(", ")}` : "no node answers");
    const scan = () => this.result.of("looking for nodes", this.bus.request("scan"), found);
    const all = COMMANDS.map(([command, label]) => button(`${label} all`, () => this.command("all", command)));
    const choice = select(SETS, "all", (set) => ((this.set = set), this.#show()));
    return el("div", { class: "bar" }, button("Scan", scan), el("div", { class: "group", role: "group", "aria-label": "All nodes" }, all), field("Search", this.search), field("Show", choice));
  }

  #show() {
    const all = this.bus.list();
    const wanted = all.filter((node) => isWanted(node, this.set, this.search.value));
    text(this.count, all.length ? summary(all) : "No node is heard yet.");
    set(this.list, "hidden", wanted.length === 0);
    const ids = new Set(wanted.map(({ node }) => node));
    for (const [id, row] of this.rows) if (!ids.has(id)) (row.element.remove(), this.rows.delete(id));
    for (const [position, node] of wanted.entries()) this.#place(position, node);
  }

  #place(position, node) {
    if (!this.rows.has(node.node)) this.rows.set(node.node, new Row(this, node.node));
    const row = this.rows.get(node.node);
    if (this.body.children[position] !== row.element) this.body.insertBefore(row.element, this.body.children[position] ?? null);
    row.show(node);
  }
}
