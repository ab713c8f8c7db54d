// One node of the overview: its state, and its commands.

import { button, el, set, text } from "../dom.js";
import { hex, percent, seconds } from "../format.js";

export const COLUMNS = ["Node", "Name", "Personality", "State", "EMCY", "Heartbeat", "Load", "Actions"];

export class Row {
  /** `owner`: the view, with `bus`, `commands`, `command` and `save`. */
  constructor(owner, id) {
    Object.assign(this, { owner, id });
    this.cells = Object.fromEntries(COLUMNS.slice(1, -1).map((name) => [name, el("td", { data: { label: name } })]));
    const group = el("div", { class: "group", role: "group", "aria-label": `Node ${id}` }, this.#actions());
    const actions = el("td", { data: { label: "Actions" } }, this.#more(), group);
    this.element = el("tr", { data: { node: id } }, el("th", { scope: "row", data: { label: "Node" } }, this.#look()), Object.values(this.cells), actions);
  }

  show(node) {
    const { element, cells } = this;
    set(element, "data-kind", node.alive ? null : "gone");
    text(cells.Name, nameOf(node));
    set(cells.Name, "title", identity(node));
    text(cells.Personality, node.personality ?? "-");
    text(cells.State, stateOf(node));
    set(cells.State, "data-kind", node.alive && node.state === "operational" ? "good" : node.alive ? "warn" : "bad");
    const emcy = node.emcy ? `${seconds(node.emcy.t, 1)}: ${node.emcy.text}` : "none";
    text(cells.EMCY, emcy);
    set(cells.EMCY, "title", node.emcy ? emcy : null);
    set(cells.EMCY, "data-kind", node.emcy?.active ? "bad" : node.emcy ? "good" : "none");
    text(cells.Heartbeat, node.heartbeat == null ? "none" : seconds(node.heartbeat, 2));
    text(cells.Load, `${percent(node.load)}, ${node.frames}/s`);
  }

  #look() {
    const { owner: { bus }, id } = this;
    const look = () => {
      bus.choose(id);
      location.hash = "live";
    };
    return button(String(id), look, { class: "plain", "aria-label": `Node ${id}: show its values` });
  }

  #actions() {
    const { owner, id } = this;
    const actions = [...owner.commands.map(([command, label]) => button(label, () => owner.command(id, command))), button("Save", () => owner.save(id))];
    for (const action of actions) set(action, "aria-label", `${action.textContent} node ${id}`);
    return actions;
  }

  /** On a narrow screen the commands of a node are shown on request. */
  #more() {
    const more = button("⋯", () => {
      const isOpen = more.getAttribute("aria-expanded") === "true";
      set(more, "aria-expanded", String(!isOpen));
      set(this.element, "data-open", isOpen ? null : "yes");
    }, { class: "more", "aria-expanded": "false", "aria-label": `Commands of node ${this.id}` });
    return more;
  }
}

export function nameOf({ name, device_type }) {
  return name ?? (device_type == null ? "not identified yet" : `unknown device ${hex(device_type)}`);
}

function identity({ vendor, product, revision, serial, version, hardware, note }) {
  const facts = `vendor ${hex(vendor)}, product ${hex(product)}, revision ${hex(revision)}, serial number ${hex(serial)}, software ${version ?? "-"}, hardware ${hardware ?? "-"}`;
  return note ? `${facts}; ${note}` : facts;
}

export function stateOf({ alive, state, updating, other_client }) {
  if (updating) return "updating";
  const shown = alive ? (state ?? "no heartbeat heard") : "not heard any more";
  return other_client ? `${shown}, another client is active` : shown;
}
