// A switch that is on or off.

import { el } from "../dom.js";

/** `onChange` may refuse by a rejected promise; then the switch goes back. */
export function toggle(label, isOn, onChange, attributes = {}) {
  const box = el("input", { type: "checkbox", role: "switch", prop: { checked: isOn }, ...attributes });
  box.addEventListener("change", async () => {
    try {
      await onChange(box.checked);
    } catch {
      box.checked = !box.checked;
    }
  });
  const element = el("label", { class: "switch" }, box, el("span", {}, label));
  return { element, box };
}
