// The list to choose a node from. All views share one choice.

import { el, field, select, setChoices } from "../dom.js";

export function nodeChoice(bus) {
  const list = select([], null, (node) => bus.choose(Number(node)));
  const show = () => {
    setChoices(list, bus.list().map((node) => [node.node, `${node.node}: ${node.name ?? "unknown device"}`]), bus.chosen);
    if (bus.chosen != null) list.value = bus.chosen;
  };
  bus.on("nodes", show);
  bus.on("chosen", show);
  show();
  return el("div", { class: "node-choice" }, field("Node", list));
}
