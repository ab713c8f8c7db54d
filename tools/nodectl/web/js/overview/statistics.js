// The statistics of the bus: load with its peak, frames, error frames, and the state of the CAN controller.

import { button, el, set, svg, text } from "../dom.js";
import { percent, seconds } from "../format.js";

/** The number of seconds that the curve of the load shows. */
const KEPT = 120;
const [WIDTH, HEIGHT] = [KEPT, 30];

/** What each tile shows: a value, a line below it, and the kind of the value (good, warn, bad). */
const TILES = {
  "Load": ({ load, bit_rate }) => [percent(load), bit_rate == null ? "bit rate unknown" : `at ${bit_rate} kbit/s`, kindOf(load)],
  "Peak (0.1 s)": (_, { peak, since }) => [percent(peak), `since ${seconds(since, 0)}`, kindOf(peak)],
  "Frames": ({ frames, total }) => [`${frames}/s`, `${total} in all`],
  "Error frames": ({ controller: { error_frames: count } }) => [count == null ? "-" : String(count), count == null ? "not reported" : "since the bus was opened", count ? "bad" : count === 0 ? "good" : "none"],
  "Controller": ({ controller }) => [controller.state ?? "-", counters(controller), { "error-active": "good", "error-warning": "warn" }[controller.state] ?? (controller.state ? "bad" : "none")],
};

export function statistics(bus) {
  const history = { loads: [], peak: null, since: null };
  const tiles = Object.fromEntries(Object.keys(TILES).map((name) => [name, tile(name)]));
  const curve = svg("polyline", { class: "curve" });
  const drawing = svg("svg", { class: "spark", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", "aria-label": `Load of the last ${KEPT} s` }, curve);
  const show = () => bus.status && Object.entries(TILES).forEach(([name, of]) => fill(tiles[name], of(known(bus.status), history)));
  const reset = button("Reset", () => (forget(history, bus.status), show()), { class: "plain", "aria-label": "Reset the peak load" });
  tiles.Load.element.append(drawing);
  tiles["Peak (0.1 s)"].element.append(reset);
  bus.on("status", (status) => {
    take(history, status);
    set(curve, "points", line(history.loads));
    show();
  });
  return el("section", { class: "tiles", "aria-label": "Statistics of the bus" }, Object.values(tiles).map(({ element }) => element));
}

/** The points of the curve, from 0 to the greatest load of the shown time. */
function line(loads) {
  const most = Math.max(...loads, 0.01);
  return loads.map((load, at) => `${(WIDTH * at) / Math.max(1, loads.length - 1)},${HEIGHT - 1 - (load / most) * (HEIGHT - 2)}`).join(" ");
}

function known(status) {
  return { ...status, controller: status.controller ?? {} };
}

function tile(name) {
  const [value, line] = [el("strong", {}, "-"), el("small", {}, "")];
  return { value, line, element: el("div", { class: "tile", data: { tile: name } }, el("h3", {}, name), value, line) };
}

function fill({ value, line }, [shown, below, kind = "none"]) {
  text(value, shown);
  set(value, "data-kind", kind);
  text(line, below);
}

function take(history, { load, peak, t }) {
  history.loads.push(load ?? 0);
  if (history.loads.length > KEPT) history.loads.shift();
  history.since ??= t;
  if (peak != null) history.peak = Math.max(history.peak ?? 0, peak);
}

function forget(history, status) {
  [history.peak, history.since] = [status?.peak ?? null, status?.t ?? null];
}

/** Buses with more than 50 % load delay frames of low priority noticeably, with more than 80 % for long. */
function kindOf(load) {
  if (load == null) return "none";
  return load > 0.8 ? "bad" : load > 0.5 ? "warn" : "good";
}

function counters({ transmit_errors: transmit, receive_errors: receive, state }) {
  if (transmit != null || receive != null) return `TEC ${transmit ?? "-"}, REC ${receive ?? "-"}`;
  return state == null ? "not reported" : "counters not reported";
}
