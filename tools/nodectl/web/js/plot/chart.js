// One chart: the signals of one unit over time, drawn by Chart.js.

import { el, set, text } from "../dom.js";
import { number, quantity } from "../format.js";
import { legend } from "./export.js";
import { Limits } from "./limits.js";
import { drawCursor, drawMarks } from "./marks.js";
import { points } from "./series.js";
import { colour, line } from "./theme.js";

/** The columns of the values below a chart. */
const HEAD = ["Cursor", "Min", "Max", "Max - min"];

export class UnitChart {
  /** `signals`: `{key, name, position, status}`; the colour depends on the position. */
  constructor(unit, signals, { recorder, time, faults }) {
    Object.assign(this, { unit, signals, recorder, time, faults });
    this.canvas = el("canvas", { tabindex: 0, role: "img" });
    this.limits = new Limits(unit);
    this.rows = signals.map((signal) => this.#row(signal));
    const table = this.#table();
    this.element = el("div", {}, el("div", { class: "chart" }, this.canvas), el("div", { class: "below" }, el("div", { class: "wide" }, table), this.limits.element));
    this.chart = new window.Chart(this.canvas, this.#configuration());
  }

  /** Draws the present time window. */
  draw() {
    const { from, to } = this.time;
    const columns = Math.max(100, this.chart.width);
    this.chart.data.datasets.forEach((drawn, i) => {
      drawn.data = points(this.recorder, this.signals[i], from, to, columns);
      this.#show(this.rows[i], this.signals[i], drawn.data);
    });
    Object.assign(this.chart.options.scales.x, { min: from, max: to });
    Object.assign(this.chart.options.scales.y, this.limits.values);
    this.chart.update("none");
    text(this.at, this.time.cursor == null ? "Cursor" : `At ${this.time.cursor.toFixed(3)} s`);
    set(this.canvas, "aria-label", this.#words());
  }

  destroy() {
    this.chart.destroy();
    this.element.remove();
  }

  /** The position of a pointer as a share of the width: 0 at the left end of the time, 1 at the right end. */
  share(event) {
    const { left, right } = this.chart.chartArea;
    return Math.min(1, Math.max(0, (event.offsetX - left) / (right - left)));
  }

  #table() {
    const head = [this.unit, ...HEAD].map((name) => el("th", { scope: "col" }, name));
    this.at = head[1];
    return el("table", { class: "extremes" }, el("caption", { class: "unseen" }, `Values in the plot, ${this.unit || "without a unit"}`), el("thead", {}, el("tr", {}, head)), el("tbody", {}, this.rows.map(({ row }) => row)));
  }

  #row({ name, position }) {
    const cells = HEAD.map((label) => el("td", { class: "number", data: { label } }));
    return { cells, row: el("tr", {}, el("th", { scope: "row" }, legend(position), name), cells) };
  }

  /** The value at the cursor, and the extremes of the shown time. */
  #show({ cells }, { key }, shown) {
    const { from, to, cursor } = this.time;
    const values = shown.filter(({ x, y }) => x >= from && x <= to && typeof y === "number").map(({ y }) => y);
    const [least, greatest] = values.length ? [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))] : [null, null];
    const at = cursor == null ? null : this.recorder.of(key).at(cursor);
    [at, least, greatest, least == null ? null : greatest - least].forEach((value, i) => text(cells[i], typeof value === "number" ? number(value) : "-"));
  }

  #words() {
    const values = this.signals.map(({ key, name }) => `${name} ${quantity(this.recorder.of(key).newest ?? null, this.unit)}`);
    return `Plot of the last ${this.time.length.toPrecision(2)} s: ${values.join(", ")}`;
  }

  #configuration() {
    const [words, grid] = [colour("muted"), colour("edge")];
    const axis = (title) => ({ type: "linear", grid: { color: grid }, ticks: { color: words, maxTicksLimit: 8 }, title: { display: true, text: title, color: words } });
    const y = { ...axis(this.unit || "value"), grace: "5%", afterFit: (scale) => (scale.width = 72) };
    const x = { ...axis("s"), ticks: { ...axis("").ticks, maxRotation: 0, autoSkipPadding: 24, includeBounds: false } };
    return {
      type: "line",
      data: { datasets: this.signals.map((signal) => dataset(signal)) },
      options: {
        animation: false, parsing: false, normalized: true, responsive: true, maintainAspectRatio: false, events: [],
        elements: { point: { radius: 0 } },
        scales: { x, y },
        plugins: { legend: { display: false }, tooltip: { enabled: false } },
      },
      plugins: [{ id: "faults", afterDatasetsDraw: (chart) => (drawMarks(chart, this.faults()), drawCursor(chart, this.time.cursor)) }],
    };
  }
}

function dataset({ name, position }) {
  const { colour: borderColor, dash: borderDash } = line(position);
  return { label: name, data: [], borderColor, borderDash, borderWidth: 1.5, spanGaps: false, tension: 0 };
}
