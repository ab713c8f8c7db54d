// One chart: the signals of one unit over time, drawn by Chart.js.

import { el, set } from "../dom.js";
import { quantity } from "../format.js";
import { drawMarks } from "./marks.js";
import { colour, line } from "./theme.js";

export class UnitChart {
  /** `signals`: `{key, name, position}`; the colour depends on the position. */
  constructor(unit, signals, { recorder, time, faults }) {
    Object.assign(this, { unit, signals, recorder, time, faults });
    this.canvas = el("canvas", { tabindex: 0, role: "img" });
    this.element = el("div", { class: "chart" }, this.canvas);
    this.chart = new window.Chart(this.canvas, this.#configuration());
  }

  /** Draws the present time window. */
  draw() {
    const { from, to } = this.time;
    const columns = Math.max(100, this.chart.width);
    this.chart.data.datasets.forEach((drawn, i) => {
      drawn.data = this.recorder.of(this.signals[i].key).envelope(from, to, columns);
    });
    Object.assign(this.chart.options.scales.x, { min: from, max: to });
    this.chart.update("none");
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

  #words() {
    const values = this.signals.map(({ key, name }) => `${name} ${quantity(this.recorder.of(key).newest ?? null, this.unit)}`);
    return `Plot of the last ${this.time.length.toPrecision(2)} s: ${values.join(", ")}`;
  }

  #configuration() {
    const [text, grid] = [colour("muted"), colour("edge")];
    const axis = (title) => ({ type: "linear", grid: { color: grid }, ticks: { color: text, maxTicksLimit: 8 }, title: { display: true, text: title, color: text } });
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
      plugins: [{ id: "faults", afterDatasetsDraw: (chart) => drawMarks(chart, this.faults()) }],
    };
  }
}

function dataset({ name, position }) {
  const { colour: borderColor, dash: borderDash } = line(position);
  return { label: name, data: [], borderColor, borderDash, borderWidth: 1.5, spanGaps: false, tension: 0 };
}
