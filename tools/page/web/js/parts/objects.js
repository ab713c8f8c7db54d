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

/** A field for one object. `show` reads the object, "Write" writes it. */
export function objectField(bus, label, index, sub, hint = "") {
  const input = el("input", { autocomplete: "off", inputmode: "decimal" });
  const result = outcome();
  const form = el("form", { class: "bar", novalidate: true }, field(label, input, hint), el("button", { type: "submit", "aria-label": `Write ${label}` }, "Write"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    result.of("writing", write(bus, index, sub, input.value.trim()), (value) => (value?.text == null ? "written" : `written, reads ${value.text} ${value.unit}`));
  });
  const show = async () => {
    const { values: [value] } = await bus.request("read", { node: bus.chosen, objects: [[index, sub]] });
    if (value.error) result.bad(value.error);
    else input.value = value.text;
  };
  return { element: el("div", { class: "object-field" }, form, result.line), show, input };
}
