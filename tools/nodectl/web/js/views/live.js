// Live: process values with unit and status, and their plots.

import { button, el, field, select, set, text } from "../dom.js";
import { offer } from "../file.js";
import { address, quantity, seconds, signalKey } from "../format.js";
import { nodeChoice } from "../parts/node_choice.js";
import { UnitChart } from "../plot/chart.js";
import { csv, drawing, legend } from "../plot/export.js";
import { addGestures } from "../plot/gestures.js";
import { onTheme } from "../plot/theme.js";
import { Boards } from "../stimuli/boards.js";
import { TimeWindow } from "../plot/time_window.js";

const LENGTHS = [1, 5, 10, 30, 60, 300];
const FRAME_MS = 40;
const SHOWN_FAULTS = 20;

export function live(bus, recorder) {
  const view = new Live(bus, recorder);
  return { name: "live", title: "Live", content: view.content, time: view.time, show: () => view.show(), hide: () => view.hide() };
}

class Live {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder, time: new TimeWindow(10), shown: new Map(), offered: [], charts: [], isShown: false });
    this.table = el("tbody");
    this.plots = el("div", { class: "plots" });
    this.faults = el("ul", { class: "faults", "aria-label": "Faults" });
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
    const head = ["Show", "Object", "Signal", "Value", "Age", "Status", "PDO"].map((name) => el("th", { scope: "col" }, name));
    const table = el("table", { class: "signals" }, el("caption", { class: "unseen" }, "Process values"), el("thead", {}, el("tr", {}, head)), this.table);
    const side = el("div", { class: "side" }, el("div", { class: "wide" }, table), el("h3", {}, "Faults"), this.faults, this.boards.element);
    return el("div", {}, el("div", { class: "bar" }, nodeChoice(this.bus), ...this.#tools()), this.empty, el("div", { class: "live" }, this.plots, side));
  }

  #tools() {
    this.pause = button("Pause", () => this.time.toggle(), { "aria-pressed": "false" });
    this.length = select(LENGTHS.map((length) => [length, `${length} s`]), 10, (length) => this.time.setLength(Number(length)));
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
    bus.connection.on("mapping", ({ node }) => node === bus.chosen && this.#ask());
    recorder.on("samples", () => (this.isStale = true));
    time.addEventListener("change", () => this.#showTime());
    onTheme(() => this.#makeCharts());
  }

  /** Follows the content of the chosen node's TPDOs, also while another view is shown, so that no samples are missing. */
  async #ask() {
    const node = this.bus.chosen;
    if (node == null || !this.bus.connection.connected) return;
    try {
      const { signals } = await this.bus.request("signals", { node });
      if (node !== this.bus.chosen) return;
      this.offered = signals;
      this.#showSignals();
      await this.#follow();
    } catch (error) {
      text(this.empty, error.message);
    }
  }

  /** Objects in no PDO are read by SDO, only while this view is shown: a node has one SDO channel for all of its masters. */
  async #follow() {
    const signals = this.offered.filter(({ tpdo }) => tpdo != null || this.isShown);
    const statuses = this.isShown ? signals.map(statusKey).filter(Boolean) : [];
    await this.recorder.want("live", [...new Set([...signals.map(({ signal }) => signal), ...statuses])]).catch(() => {});
  }

  #showSignals() {
    const numbers = this.offered.filter(({ kind }) => kind !== "text");
    const fresh = numbers.filter(({ signal }) => !this.shown.has(signal)).map(({ signal }) => [signal, true]);
    this.shown = new Map([...this.shown, ...fresh]);
    this.rows = this.offered.map((signal, position) => this.#row(signal, position));
    this.table.replaceChildren(...this.rows.map(({ row }) => row));
    const isOperational = this.bus.node()?.state === "operational";
    text(this.empty, this.offered.length ? "" : isOperational ? "No TPDO of this node carries a value." : "The node sends TPDOs in the state operational only: start it in the overview.");
    this.#makeCharts();
  }

  #row(signal, position) {
    const box = el("input", { type: "checkbox", "aria-label": `Plot ${signal.name}`, prop: { checked: this.shown.get(signal.signal) ?? false, disabled: signal.kind === "text" } });
    box.addEventListener("change", () => {
      this.shown.set(signal.signal, box.checked);
      this.#makeCharts();
    });
    const [value, age, status] = [el("td", { class: "number" }), el("td", { class: "number age" }), el("td")];
    const pdo = signal.tpdo == null ? "SDO" : `TPDO ${signal.tpdo}`;
    const name = el("th", { scope: "row" }, legend(position), signal.name);
    const row = el("tr", { data: { signal: signal.signal } }, el("td", {}, box), el("td", {}, address(signal.index, signal.sub)), name, value, age, status, el("td", {}, pdo));
    return { row, value, age, status, signal };
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
    this.offered.forEach((signal, position) => {
      if (!this.shown.get(signal.signal) || signal.kind === "text") return;
      if (!units.has(signal.unit)) units.set(signal.unit, []);
      const title = `${address(signal.index, signal.sub)} ${signal.name}`;
      units.get(signal.unit).push({ key: signal.signal, name: signal.name, title, unit: signal.unit, position, status: statusKey(signal) });
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
    for (const row of this.rows ?? []) this.#showValue(row);
  }

  #showValue({ value, age, status, signal }) {
    const series = this.recorder.of(signal.signal);
    const state = this.bus.node()?.state;
    const isOld = signal.tpdo != null && state !== "operational";
    const since = series.t.length ? Math.max(0, this.recorder.t - series.t.at(-1)) : null;
    text(age, since == null ? "-" : seconds(since, since < 10 ? 2 : 0));
    if (series.newest === undefined && !isOld) {
      text(status, signal.tpdo == null ? "not read yet" : `TPDO ${signal.tpdo} has not come: it is sent on its events (type, event timer)`);
      return;
    }
    text(value, isOld ? "-" : quantity(series.newest, signal.unit));
    const words = isOld ? `not sent: ${state ?? "not heard"}` : (series.meaning ?? this.#statusOf(signal) ?? (series.newest == null ? "not valid" : "ok"));
    text(status, words);
    set(status, "data-kind", ["ok", "valid"].includes(words) ? "good" : "bad");
  }

  #statusOf(signal) {
    return this.recorder.series.get(statusKey(signal))?.meaning ?? null;
  }

  #showTime() {
    const { follows, length } = this.time;
    text(this.pause, follows ? "Pause" : "Follow");
    set(this.pause, "aria-pressed", String(!follows));
    if (LENGTHS.includes(length)) this.length.value = length;
    this.isStale = true;
  }

  #ownFaults() {
    return this.bus.faults.filter(({ node }) => node === this.bus.chosen);
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

/** The status of a process value of CiA 404 (6150h), which is read where no PDO carries it; `null` for any other signal. */
function statusKey({ node, index, sub }) {
  const isSecondDevice = (index & 0x800) !== 0;
  const isProcessValue = [0x6130, 0x7130, 0x9130].includes(index & ~0x800);
  return isProcessValue ? signalKey(node, isSecondDevice ? 0x6950 : 0x6150, sub) : null;
}
