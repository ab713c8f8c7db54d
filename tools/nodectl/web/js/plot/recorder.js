// Follows signals for all views at once and keeps their samples.

import { Series } from "./series.js";

export class Recorder extends EventTarget {
  constructor(bus) {
    super();
    this.bus = bus;
    this.series = new Map();
    this.signals = new Map();
    this.t = 0;
    this.lost = 0;
    this.wishes = new Map();
    bus.connection.on("live", (message) => this.#take(message));
    bus.on("status", ({ t }) => this.#advance(t));
    bus.on("restart", () => this.#restart());
    bus.on("connected", () => bus.connection.connected && this.#follow());
    bus.connection.on("mapping", ({ node }) => this.#keys().some((key) => key.startsWith(`${node}:`)) && this.#follow());
  }

  on(name, listener) {
    this.addEventListener(name, ({ detail }) => listener(detail));
  }

  /** Sets the signals that one view follows, instead of its former ones; with `isRead`, they are read while their TPDO does not come. */
  async want(view, keys, isRead = false) {
    this.wishes.set(view, { keys, isRead });
    await this.#follow();
  }

  /** The samples of a signal. */
  of(key) {
    if (!this.series.has(key)) this.series.set(key, new Series());
    return this.series.get(key);
  }

  async #follow() {
    if (!this.bus.connection.connected) return;
    const { signals } = await this.bus.request("follow", { signals: this.#keys(), read: this.#keys(({ isRead }) => isRead) });
    for (const signal of signals) this.#describe(signal);
    this.#tell("signals");
  }

  #keys(filter = () => true) {
    return [...new Set([...this.wishes.values()].filter(filter).flatMap(({ keys }) => keys))];
  }

  /** Samples in another unit are dropped. */
  #describe(signal) {
    const before = this.signals.get(signal.signal);
    if (before && before.unit !== signal.unit) this.of(signal.signal).clear();
    this.signals.set(signal.signal, signal);
  }

  #take({ t, lost, signals }) {
    for (const samples of signals) this.of(samples.signal).take(samples);
    // The number of all lost samples so far.
    this.lost = lost;
    this.#advance(t);
    this.#tell("samples");
  }

  #advance(t) {
    this.t = Math.max(this.t, t);
  }

  #restart() {
    for (const series of this.series.values()) series.clear();
    this.t = 0;
    this.#tell("samples");
  }

  #tell(name) {
    this.dispatchEvent(new CustomEvent(name));
  }
}
