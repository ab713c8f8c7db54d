// Live: process values with unit and status, and their plots.

import { button, el, field, select, set, text } from "../dom.js";
import { offer } from "../file.js";
import { address, seconds } from "../format.js";
import { Adder } from "../live/adder.js";
import { named, SignalTable, statusKey } from "../live/signals.js";
import { nodeChoice } from "../parts/node_choice.js";
import { UnitChart } from "../plot/chart.js";
import { csv, drawing } from "../plot/export.js";
import { addGestures } from "../plot/gestures.js";
import { onTheme } from "../plot/theme.js";
import { Boards } from "../stimuli/boards.js";
import { TimeWindow } from "../plot/time_window.js";

const LENGTHS = [[1, "1 s"], [5, "5 s"], [10, "10 s"], [30, "30 s"], [60, "1 min"], [300, "5 min"], [900, "15 min"], [3600, "1 h"]];
const FRAME_MS = 40;
const SHOWN_FAULTS = 20;

export function live(bus, recorder) {
  const view = new Live(bus, recorder);
  return { name: "live", title: "Live", content: view.content, time: view.time, show: () => view.show(), hide: () => view.hide() };
}

class Live {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder, time: new TimeWindow(10), shown: new Map(), offered: [], added: new Map(), charts: [], isShown: false });
    this.table = new SignalTable(this);
    this.adder = new Adder(bus, (signal) => this.#add(signal));
    this.plots = el("div", { class: "plots" });
    this.faults = el("ul", { class: "faults", "aria-label": "Events" });
    this.empty = el("p", { class: "hint" });
    this.boards = new Boards(bus, ({ node }) => node === bus.chosen);
    this.content = this.#layout();
    this.#listen();
  }

  show() {
    this.isShown = true;
    this.isStale = true;
    this.#follow();
    this.#tick();
  }

  hide() {
    this.isShown = false;
    this.#follow();
  }

  #layout() {
    const side = el("div", { class: "side" }, el("div", { class: "wide" }, this.table.element), this.adder.element, el("h3", {}, "Events"), this.faults, this.boards.element);
    return el("div", {}, el("div", { class: "bar" }, nodeChoice(this.bus), ...this.#tools()), this.empty, el("div", { class: "live" }, this.plots, side));
  }

  #tools() {
    this.pause = button("Pause", () => this.time.toggle(), { "aria-pressed": "false" });
    this.length = select(LENGTHS, 10, (length) => this.time.setLength(Number(length)));
    return [
      field("Time", this.length),
      el("div", { class: "group", role: "group", "aria-label": "Time axis" },
        this.pause,
        button("Zoom in", () => this.time.zoom(0.5)),
        button("Zoom out", () => this.time.zoom(2)),
        button("Earlier", () => this.time.move(-0.5)),
        button("Later", () => this.time.move(0.5))),
      el("div", { class: "group", role: "group", "aria-label": "Export" }, button("CSV", () => this.#csv()), button("SVG", () => this.#svg())),
    ];
  }

  #listen() {
    const { bus, recorder, time } = this;
    bus.on("chosen", () => (this.#ask(), this.boards.show()));
    bus.on("nodes", () => (this.isStale = true));
    bus.on("fault", () => this.#showFaults());
    bus.on("restart", () => this.#showFaults());
    bus.on("connected", () => this.#ask());
    bus.connection.on("mapping", ({ node }) => this.#nodes().has(node) && this.#ask());
    recorder.on("samples", () => (this.isStale = true));
    time.addEventListener("change", () => this.#showTime());
    onTheme(() => this.#showSignals());
  }

  /** Follows the content of the chosen node's TPDOs, also while another view is shown, so that no samples are missing. */
  async #ask() {
    const node = this.bus.chosen;
    if (node == null || !this.bus.connection.connected) return;
    try {
      const signals = await this.#survey(node);
      if (node !== this.bus.chosen) return;
      this.offered = signals;
      this.#showSignals();
      await this.#follow();
      // The answer may describe the added signals otherwise than the data sheet.
      if (this.listed !== JSON.stringify(this.signals)) this.#showSignals();
    } catch (error) {
      text(this.empty, error.message);
    }
  }

  /** The signals of the chosen node. The server must know the PDOs of the other nodes, too, to follow their objects. */
  async #survey(chosen) {
    const others = [...this.#nodes()].filter((node) => node !== chosen);
    const ask = (node) => this.bus.request("signals", { node });
    const [{ signals }] = await Promise.all([ask(chosen), ...others.map((node) => ask(node).catch(() => null))]);
    return signals;
  }

  /** The nodes of which a signal is listed. */
  #nodes() {
    return new Set([this.bus.chosen, ...[...this.added.values()].map(({ node }) => node)]);
  }

  /** The signals of the chosen node, and those that the user has added. */
  get signals() {
    const own = new Set(this.offered.map(({ signal }) => signal));
    const added = [...this.added.keys()].filter((key) => !own.has(key)).map((key) => ({ ...this.added.get(key), ...this.recorder.signals.get(key), isAdded: true }));
    return named([...this.offered, ...added]);
  }

  async #add(signal) {
    this.added.set(signal.signal, signal);
    this.shown.set(signal.signal, true);
    await this.#ask();
  }

  async remove(key) {
    this.added.delete(key);
    this.shown.delete(key);
    await this.#ask();
  }

  /** Shows or hides the plot of a signal. */
  plot(key, isShown) {
    this.shown.set(key, isShown);
    this.#makeCharts();
  }

  /** Objects in no PDO are read by SDO, only while this view is shown: a node has one SDO channel for all of its masters. */
  async #follow() {
    const signals = this.signals.filter(({ tpdo }) => tpdo != null || this.isShown);
    const statuses = this.isShown ? signals.map(statusKey).filter(Boolean) : [];
    await this.recorder.want("live", [...new Set([...signals.map(({ signal }) => signal), ...statuses])]).catch(() => {});
  }

  #showSignals() {
    const numbers = this.offered.filter(({ kind }) => kind !== "text");
    const fresh = numbers.filter(({ signal }) => !this.shown.has(signal)).map(({ signal }) => [signal, true]);
    this.shown = new Map([...this.shown, ...fresh]);
    this.listed = JSON.stringify(this.signals);
    this.table.list(this.signals);
    const isOperational = this.bus.node()?.state === "operational";
    text(this.empty, this.offered.length ? "" : isOperational ? "No TPDO of this node carries a value." : "The node sends TPDOs in the state operational only: start it in the overview.");
    this.#makeCharts();
  }

  #makeCharts() {
    for (const chart of this.charts) chart.destroy();
    this.charts = this.#units().map(({ unit, signals }) => this.#chart(unit, signals));
    this.plots.replaceChildren(...this.charts.map(({ element }) => element));
    this.isStale = true;
  }

  /** The chosen signals by their unit, in the order of the table. */
  #units() {
    const units = new Map();
    this.signals.forEach((signal, position) => {
      if (!this.shown.get(signal.signal) || signal.kind === "text") return;
      if (!units.has(signal.unit)) units.set(signal.unit, []);
      const title = `${address(signal.index, signal.sub)} ${signal.label}`;
      units.get(signal.unit).push({ key: signal.signal, name: signal.label, title, unit: signal.unit, position, status: statusKey(signal) });
    });
    return [...units].map(([unit, signals]) => ({ unit, signals }));
  }

  #chart(unit, signals) {
    const chart = new UnitChart(unit, signals, { recorder: this.recorder, time: this.time, faults: () => this.#ownFaults() });
    addGestures(chart, this.time);
    return chart;
  }

  #tick() {
    if (!this.isShown) return;
    this.time.advance(this.recorder.t);
    if (this.isStale) this.#draw();
    setTimeout(() => requestAnimationFrame(() => this.#tick()), FRAME_MS);
  }

  #draw() {
    this.isStale = false;
    for (const chart of this.charts) chart.draw();
    this.table.draw();
  }

  #showTime() {
    const { follows, length } = this.time;
    text(this.pause, follows ? "Pause" : "Follow");
    set(this.pause, "aria-pressed", String(!follows));
    if (LENGTHS.some(([known]) => known === length)) this.length.value = length;
    this.isStale = true;
  }

  #ownFaults() {
    const nodes = this.#nodes();
    return this.bus.faults.filter(({ node }) => nodes.has(node));
  }

  #showFaults() {
    const faults = this.bus.faults.slice(-SHOWN_FAULTS).reverse();
    this.faults.replaceChildren(...faults.map((fault) => this.#fault(fault)));
    this.isStale = true;
  }

  /** A click on a fault shows its place on the time axis. */
  #fault({ t, node, text: words, active, kind }) {
    const look = () => this.time.show(t - this.time.length / 2, t + this.time.length / 2);
    return el("li", { data: { kind: kind === "state" ? "none" : active ? "bad" : "good" } }, button(seconds(t), look, { class: "plain", "aria-label": `Show ${seconds(t)} in the plots` }), ` node ${node}: ${words}`);
  }

  #csv() {
    const signals = this.#units().flatMap(({ signals }) => signals);
    offer(`node${this.bus.chosen}.csv`, csv(this.recorder, signals, this.time), "text/csv");
  }

  #svg() {
    offer(`node${this.bus.chosen}.svg`, drawing(this.recorder, this.#units(), this.time, this.#ownFaults()), "image/svg+xml");
  }
}
