// The newest emergencies and changes of the NMT state on the bus.

import { el } from "../dom.js";
import { seconds } from "../format.js";

const SHOWN = 50;

export function events(bus) {
  const list = el("ul", { class: "events listing", tabindex: 0, "aria-label": "Events" });
  const show = () => list.replaceChildren(...(bus.faults.length ? bus.faults.slice(-SHOWN).reverse().map(line) : [el("li", { class: "hint" }, "No EMCY and no change of state since the page was opened.")]));
  bus.on("fault", show);
  bus.on("restart", show);
  show();
  return list;
}

function line({ t, node, text, kind, active }) {
  const state = kind === "state" ? "none" : active ? "bad" : "good";
  return el("li", {}, el("span", { class: "number" }, seconds(t)), el("span", {}, `node ${node}`), el("span", { data: { kind: state } }, text));
}
