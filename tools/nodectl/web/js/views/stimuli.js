// Stimuli: the inputs of the sensors of the simulated boards.

import { el } from "../dom.js";
import { Boards } from "../stimuli/boards.js";

export function stimuli(bus) {
  const boards = new Boards(bus);
  const content = el("div", {}, el("p", { class: "hint" }, "What the sensors of the simulated boards see."), boards.element);
  return { name: "stimuli", title: "Stimuli", content };
}
