// The keys, in a dialog.

import { button, el } from "./dom.js";

const KEYS = [
  ["1 to 7", "the views, in their order"],
  ["/", "search in this view"],
  ["Space", "on a plot or in the trace: pause, and go on"],
  ["+ and -", "on a plot: a shorter and a longer time"],
  ["Left and Right", "on a plot: back and forth in time"],
  ["Home", "on a plot: follow the bus again"],
  ["Up and Down", "in the trace: the frame before and the next one, with its details"],
  ["?", "these keys"],
];

export function showHelp() {
  const dialog = document.getElementById("help");
  const close = button("Close", () => dialog.close());
  const rows = KEYS.map(([key, what]) => [el("dt", {}, el("kbd", {}, key)), el("dd", {}, what)]);
  dialog.replaceChildren(el("h2", { id: "help-title" }, "Keys"), el("dl", { class: "keys" }, ...rows), close);
  dialog.showModal();
}
