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
  }

  on(name, listener) {
    this.addEventListener(name, ({ detail }) => listener(detail));
  }

  /** Sets the signals that one view follows, instead of its former ones. */
  async want(view, keys) {
    this.wishes.set(view, keys);
    await this.#follow();
  }

  /** The samples of a signal. */
  of(key) {
    if (!this.series.has(key)) this.series.set(key, new Series());
    return this.series.get(key);
  }

  async #follow() {
    if (!this.bus.connection.connected) return;
    const keys = [...new Set([...this.wishes.values()].flat())];
    const { signals } = await this.bus.request("follow", { signals: keys });
    for (const signal of signals) this.signals.set(signal.signal, signal);
    this.#tell("signals");
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
