// The boards of the simulator, as the server reports them.

import { el } from "../dom.js";
import { Board } from "./board.js";

export class Boards {
  /** Shows the boards that `isWanted` accepts. */
  constructor(bus, isWanted = () => true) {
    Object.assign(this, { bus, isWanted, shown: new Map(), boards: [], faults: [] });
    this.element = el("div", { class: "boards" });
    bus.connection.on("stimuli", (message) => this.#take(message));
    // A reset may give a node another personality.
    bus.on("nodes", () => this.show());
    bus.on("connected", () => this.load());
  }

  async load() {
    if (!this.bus.connection.connected || !this.bus.hello?.simulator) return;
    this.#take(await this.bus.request("stimuli"));
  }

  /** Shows and hides boards after the selection has changed. */
  show() {
    for (const board of this.boards) this.#showBoard(board);
  }

  #take({ boards, faults = this.faults }) {
    Object.assign(this, { boards, faults });
    for (const [id, board] of this.shown) if (!boards.some(({ board }) => board === id)) (board.element.remove(), this.shown.delete(id));
    this.show();
  }

  #showBoard(board) {
    if (!this.shown.has(board.board)) {
      this.shown.set(board.board, new Board(this.bus, board, this.faults));
      this.element.append(this.shown.get(board.board).element);
    }
    const known = this.shown.get(board.board);
    known.show(board);
    known.element.hidden = !this.isWanted(board);
  }
}
