// Objects of the chosen node, read and written by the controls of the commissioning.

import { el, field } from "../dom.js";
import { outcome } from "../outcome.js";

/** The values of some objects: numbers, or `null` where there is none. */
export async function readAll(bus, objects) {
  const { values } = await bus.request("read", { node: bus.chosen, objects });
  return values.map((value) => (value.error ? null : value.value));
}

export function write(bus, index, sub, value) {
  return bus.request("write", { node: bus.chosen, index, sub, value });
}

/** The values that the user has typed for a node and not yet written. A later read of this node does not replace them. */
export class Edits {
  constructor(bus) {
    Object.assign(this, { bus, node: null, asked: null });
  }

  begin() {
    this.node = this.bus.chosen;
  }

  end() {
    this.node = null;
  }

  /** Reads from the chosen node; `undefined` if the user edits values, or has chosen another node, when the answer comes. */
  async around(read) {
    const node = this.bus.chosen;
    if (this.asked !== node) this.end();
    this.asked = node;
    const answer = await read();
    return this.node === node || this.bus.chosen !== node ? undefined : answer;
  }
}

/** A field for one object. "Show" reads the object, "Write" writes it. */
export function objectField(bus, label, index, sub, hint = "") {
  const edits = new Edits(bus);
  const input = el("input", { autocomplete: "off", inputmode: "decimal", on: { input: () => edits.begin() } });
  const result = outcome();
  const form = el("form", { class: "bar", novalidate: true }, field(label, input, hint), el("button", { type: "submit", "aria-label": `Write ${label}` }, "Write"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    result.of("writing", write(bus, index, sub, input.value.trim()), (value) => {
      edits.end();
      return value?.text == null ? "written" : `written, reads ${value.text} ${value.unit}`;
    });
  });
  const show = async () => {
    const answer = await edits.around(() => bus.request("read", { node: bus.chosen, objects: [[index, sub]] }));
    if (!answer) return;
    const [value] = answer.values;
    if (value.error) result.bad(value.error);
    else input.value = value.text;
  };
  return { element: el("div", { class: "object-field" }, form, result.line), show, input };
}
