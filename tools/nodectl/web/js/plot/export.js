// The content of the plots as a table and as a drawing.

import { el, svg } from "../dom.js";
import { number } from "../format.js";
import { colourOf } from "./marks.js";
import { points } from "./series.js";
import { colour, line } from "./theme.js";

/** A row for each time and a column for each signal, in the format of `nodectl record --csv`. */
export function csv(recorder, signals, { from, to }) {
  const head = ["time s", ...signals.map((signal) => `${signal.title}${signal.unit ? ` [${signal.unit}]` : ""}`)];
  const rows = new Map();
  signals.forEach((signal, column) => {
    const { t, v } = recorder.of(signal.key);
    const series = recorder.of(signal.key);
    for (let at = series.position(from); at < t.length && t[at] <= to; at += 1) {
      if (!rows.has(t[at])) rows.set(t[at], new Array(signals.length).fill(""));
      rows.get(t[at])[column] = v[at] == null ? "" : v[at];
    }
  });
  const lines = [...rows].sort(([a], [b]) => a - b).map(([t, values]) => [t.toFixed(6), ...values]);
  return [head, ...lines].map((row) => row.map(cell).join(",")).join("\n") + "\n";
}

function cell(value) {
  const text = String(value);
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

const [WIDTH, HEIGHT, LEFT, BOTTOM, TOP, GAP] = [960, 220, 80, 30, 40, 20];

/** A drawing with a chart for each unit. */
export function drawing(recorder, units, time, faults) {
  const height = TOP + units.length * (HEIGHT + GAP);
  const root = svg("svg", { xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${WIDTH} ${height}`, width: WIDTH, height, "font-family": "sans-serif", "font-size": 12 });
  root.append(svg("rect", { width: WIDTH, height, fill: colour("surface") }));
  units.forEach(({ unit, signals }, i) => {
    const group = svg("g", { transform: `translate(0 ${TOP + i * (HEIGHT + GAP)})` });
    root.append(group);
    drawUnit(group, recorder, unit, signals, time, faults);
  });
  return new XMLSerializer().serializeToString(root);
}

function drawUnit(group, recorder, unit, signals, { from, to }, faults) {
  const lines = signals.map((signal) => ({ ...signal, points: points(recorder, signal, from, to, WIDTH - LEFT) }));
  const values = lines.flatMap(({ points }) => points.map(({ y }) => y)).filter((y) => typeof y === "number");
  const [low, high] = range(values);
  const x = (t) => LEFT + ((Math.min(to, Math.max(from, t)) - from) / (to - from)) * (WIDTH - LEFT - 10);
  const y = (v) => HEIGHT - BOTTOM - ((v - low) / (high - low)) * (HEIGHT - BOTTOM - 10);
  drawAxes(group, [from, to], [low, high], x, y, unit);
  for (const { t, kind, active } of faults.filter(({ t }) => t >= from && t <= to)) {
    group.append(svg("line", { x1: x(t), x2: x(t), y1: 10, y2: HEIGHT - BOTTOM, stroke: colour(colourOf(kind, active)) }));
  }
  lines.forEach((signal, i) => drawLine(group, signal, i, x, y));
}

function range(values) {
  const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  if (!Number.isFinite(low)) return [0, 1];
  return low === high ? [low - 0.5, high + 0.5] : [low, high];
}

function drawAxes(group, times, values, x, y, unit) {
  const [fill, stroke] = [colour("text"), colour("edge")];
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    const t = times[0] + share * (times[1] - times[0]);
    const v = values[0] + share * (values[1] - values[0]);
    group.append(svg("line", { x1: LEFT, x2: WIDTH - 10, y1: y(v), y2: y(v), stroke }));
    group.append(svg("text", { x: LEFT - 8, y: y(v) + 4, "text-anchor": "end", fill }, number(v)));
    group.append(svg("text", { x: x(t), y: HEIGHT - 10, "text-anchor": "middle", fill }, `${t.toFixed(2)} s`));
  }
  group.append(svg("text", { x: 8, y: 4, fill }, unit || "value"));
}

function drawLine(group, { name, position, points }, i, x, y) {
  const style = line(position);
  let pen = "M";
  const path = points.map((point) => {
    if (typeof point.y !== "number") return ((pen = "M"), "");
    const step = `${pen}${x(point.x).toFixed(2)} ${y(point.y).toFixed(2)}`;
    pen = "L";
    return step;
  });
  group.append(svg("path", { d: path.join(""), fill: "none", stroke: style.colour, "stroke-width": 1.5, "stroke-dasharray": style.dash.join(" ") || null }));
  group.append(svg("text", { x: LEFT + 8 + i * 220, y: 4, fill: style.colour }, name));
}

/** The legend of the colours, as an element. */
export function legend(position) {
  const { colour: stroke, dash } = line(position);
  return el("span", { class: "swatch", "aria-hidden": "true", style: `border-top: 3px ${dash.length ? "dashed" : "solid"} ${stroke}` });
}
