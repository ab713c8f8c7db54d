// Stimuli: what the sensors of the simulated boards see.

import { el, text } from "../dom.js";
import { Board } from "../stimuli/board.js";

export function stimuli(bus) {
  const boards = new Map();
  const hint = el("p", { class: "hint" }, "What the sensors of the simulated boards see.");
  const list = el("div", { class: "boards" });
  let faults = [];
  const take = (message) => {
    faults = message.faults ?? faults;
    for (const board of message.boards) showBoard(bus, boards, list, board, faults);
  };
  const load = async () => {
    if (!bus.connection.connected || !bus.hello?.simulator) return;
    try {
      take(await bus.request("stimuli"));
    } catch (error) {
      text(hint, error.message);
    }
  };
  bus.on("hello", load);
  bus.connection.on("stimuli", take);
  return { name: "stimuli", title: "Stimuli", content: el("div", {}, hint, list), show: load };
}

function showBoard(bus, boards, list, board, faults) {
  const known = boards.get(board.board);
  if (known) return known.show(board);
  const shown = new Board(bus, board, faults);
  boards.set(board.board, shown);
  list.append(shown.element);
}
