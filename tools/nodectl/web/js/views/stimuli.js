// Stimuli: the inputs of the sensors of the simulated boards.

import { el, field, select, setChoices } from "../dom.js";
import { Boards } from "../stimuli/boards.js";

/** With more boards than this, one board is shown at a time. */
const AT_ONCE = 3;

export function stimuli(bus) {
  const choice = select([["all", "all boards"]], "all", () => boards.show());
  const boards = new Boards(bus, ({ board }) => choice.value === "all" || String(board) === choice.value);
  let isFirst = true;
  bus.connection.on("stimuli", ({ boards: all }) => {
    setChoices(choice, [["all", "all boards"], ...all.map(({ board, personality }) => [String(board), `${board}: ${personality ?? "-"}`])]);
    if (isFirst && all.length > AT_ONCE) choice.value = String(all[0].board);
    isFirst = false;
    boards.show();
  });
  const content = el("div", {}, el("p", { class: "hint" }, "Inputs of the sensors of the simulated boards."), el("div", { class: "bar" }, field("Board", choice)), boards.element);
  return { name: "stimuli", title: "Stimuli", content };
}
