// The programs that a node has, its trial, and its log of updates.

import { el, set, text } from "../dom.js";
import { hex } from "../format.js";

/** The rows of the box: the object, its name, and how its value is shown. A value without a text has no row. */
const ROWS = [
  [[0x1F56, 1], "Identification", ({ value }) => hex(value)],
  [[0x2002, 1], "Trial", ({ meaning, text: words }) => meaning ?? words],
  [[0x2004, 4], "Downloaded program", ({ value }) => value > 0 && hex(value)],
  [[0x2004, 5], "Kept program", ({ value }) => value > 0 && hex(value)],
  [[0x2004, 2], "Security counter", ({ text: words }) => words],
  [[0x2004, 3], "Key generation", ({ text: words }) => words],
  [[0x2004, 6], "Sector erases", ({ text: words }) => words],
  [[0x2004, 7], "Clears allowed", ({ text: words }) => words],
];
const LOG = [0x2006, 0];

export class Programs {
  constructor(bus) {
    this.bus = bus;
    this.facts = el("dl", { class: "keys" });
    this.log = el("ul", { "aria-label": "Log of updates" });
    this.hint = el("p", { class: "hint" });
    this.element = el("div", { class: "programs" },
      el("section", { class: "box", "aria-labelledby": "programs-title" }, el("h3", { id: "programs-title" }, "Program of the node"), this.facts),
      el("section", { class: "box", "aria-labelledby": "update-log-title" }, el("h3", { id: "update-log-title" }, "Log of updates, the newest first"), this.log, this.hint));
    set(this.element, "hidden", true);
  }

  /** Reads the objects of the chosen node. A node of another project has others at these places. */
  async show() {
    const node = this.bus.chosen;
    const isOwn = this.bus.connection.connected && this.bus.node()?.personality;
    const objects = [...ROWS.map(([object]) => object), LOG];
    const answer = isOwn ? await this.bus.request("read", { node, objects }).catch(() => null) : null;
    if (this.bus.chosen !== node) return;
    set(this.element, "hidden", !answer);
    if (answer) this.#fill(answer.values);
  }

  #fill(values) {
    const log = values.at(-1);
    const rows = ROWS.map(([, name, shown], at) => [name, values[at].error ? null : shown(values[at])]);
    this.facts.replaceChildren(...rows.filter(([, shown]) => shown).flatMap(([name, shown]) => [el("dt", {}, name), el("dd", {}, shown)]));
    const events = log.meaning ? log.meaning.split("; ") : [];
    this.log.replaceChildren(...events.map((event) => el("li", {}, event)));
    text(this.hint, log.error ?? (events.length > 0 ? "" : "No update since the log was begun."));
  }
}
