// Reads values as their rows come into view: a few objects at a time, and only from a node that answers.

import { isReadable } from "./check.js";

/** The number of objects of a request. Between two requests, other clients and other pages have their turn. */
const AT_ONCE = 4;
/** Rows that only pass by while the user scrolls are not read. */
const REST_MS = 150;
const PAUSE_MS = 40;
/** A node that has not answered is asked again after this time. */
const AGAIN_MS = 10_000;

export class Reader {
  /** `read` reads entries of the shown node, `isShown` is whether the view is on display. */
  constructor(bus, { read, isShown, onReason }) {
    Object.assign(this, { bus, read, isShown, onReason, rows: [], silentUntil: 0 });
    bus.on("nodes", () => this.#later());
  }

  /** The rows that are in view now. */
  look(rows) {
    this.rows = rows;
    this.#later();
  }

  /** Takes another node. */
  restart() {
    this.silentUntil = 0;
  }

  #later() {
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.#run();
    }, REST_MS);
  }

  async #run() {
    if (this.isReading) return;
    this.isReading = true;
    try {
      for (let entries = this.#next(); entries.length; entries = this.#next()) await this.#take(entries);
    } finally {
      this.isReading = false;
    }
  }

  async #take(entries) {
    try {
      await this.read(entries);
      await pause(PAUSE_MS);
    } catch (error) {
      this.silentUntil = performance.now() + AGAIN_MS;
      this.onReason(error.message);
    }
  }

  /** The next objects to read; none while the node does not answer. */
  #next() {
    if (!this.isShown()) return [];
    const reason = reasonNotToAsk(this.bus);
    if (performance.now() < this.silentUntil) return [];
    this.onReason(reason);
    if (reason) return [];
    return this.rows.filter(isMissing).slice(0, AT_ONCE).map(({ entry }) => entry);
  }
}

function isMissing({ entry, newest }) {
  return newest === undefined && isReadable(entry) && entry.type !== "DOMAIN";
}

function reasonNotToAsk(bus) {
  const node = bus.node();
  if (!bus.connection.connected || !node) return "there is no connection";
  if (node.updating) return "the node is being updated";
  if (node.other_client) return "another client is active";
  if (node.state === "stopped") return "the node is stopped";
  return node.alive || node.heartbeat == null ? "" : "the node is not heard any more";
}

function pause(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
