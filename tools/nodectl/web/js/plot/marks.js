// Faults on the time axis of a chart: a line where a fault came, a thinner line where the fault went.

import { colour } from "./theme.js";

export function drawMarks(chart, faults) {
  const { ctx, chartArea: area, scales: { x } } = chart;
  ctx.save();
  for (const fault of faults) {
    if (fault.t < x.min || fault.t > x.max) continue;
    mark(ctx, area, x.getPixelForValue(fault.t), fault);
  }
  ctx.restore();
}

/** The line at the pointer. */
export function drawCursor(chart, time) {
  const { ctx, chartArea: { top, bottom }, scales: { x } } = chart;
  if (time == null || time < x.min || time > x.max) return;
  ctx.save();
  ctx.strokeStyle = colour("text");
  ctx.lineWidth = 1;
  ctx.beginPath();
  ctx.moveTo(x.getPixelForValue(time), top);
  ctx.lineTo(x.getPixelForValue(time), bottom);
  ctx.stroke();
  ctx.restore();
}

function mark(ctx, { top, bottom }, at, { kind, active }) {
  ctx.strokeStyle = ctx.fillStyle = colour(colourOf(kind, active));
  ctx.lineWidth = active ? 2 : 1;
  ctx.setLineDash(active ? [] : [3, 3]);
  ctx.beginPath();
  ctx.moveTo(at, top);
  ctx.lineTo(at, bottom);
  ctx.stroke();
  ctx.beginPath();
  ctx.moveTo(at - 5, top);
  ctx.lineTo(at + 5, top);
  ctx.lineTo(at, top + 8);
  ctx.fill();
}

/** The name of the colour of a fault. */
export function colourOf(kind, active) {
  if (kind === "state") return "muted";
  return active ? "bad" : "good";
}
