// The signals of the live view: what they are called, and the table of their values.

import { button, el, set, text } from "../dom.js";
import { address, quantity, seconds, signalKey } from "../format.js";
import { legend } from "../plot/export.js";

const HEAD = ["Show", "Object", "Signal", "Value", "Age", "Status", "PDO"];

/** The table of the signals, with a box for each that chooses whether it is plotted. */
export class SignalTable {
  /** `owner`: the view, with `bus`, `recorder`, `shown`, `plot` and `remove`. */
  constructor(owner) {
    Object.assign(this, { owner, rows: [], body: el("tbody") });
    const head = HEAD.map((name) => el("th", { scope: "col" }, name));
    this.element = el("table", { class: "signals" }, el("caption", { class: "unseen" }, "Process values"), el("thead", {}, el("tr", {}, head)), this.body);
  }

  /** Lists signals, each with the name that it has in the plots. */
  list(signals) {
    this.rows = signals.map((signal, position) => this.#row(signal, position));
    this.body.replaceChildren(...this.rows.map(({ row }) => row));
  }

  draw() {
    for (const row of this.rows) this.#show(row);
  }

  #row(signal, position) {
    const { owner } = this;
    const isText = signal.kind === "text";
    const box = el("input", { type: "checkbox", "aria-label": `Plot ${signal.label}`, prop: { checked: owner.shown.get(signal.signal) ?? false, disabled: isText } });
    box.addEventListener("change", () => owner.plot(signal.signal, box.checked));
    const [value, age, status] = [el("td", { class: "number" }), el("td", { class: "number age" }), el("td")];
    const remove = signal.isAdded && button("×", () => owner.remove(signal.signal), { class: "plain remove", "aria-label": `Remove ${signal.label}` });
    const source = el("td", {}, signal.tpdo == null ? "SDO" : `TPDO ${signal.tpdo}`, remove ? " " : null, remove);
    const name = el("th", { scope: "row" }, legend(position), signal.label);
    const row = el("tr", { data: { signal: signal.signal } }, el("td", {}, box), el("td", {}, address(signal.index, signal.sub)), name, value, age, status, source);
    return { row, value, age, status, signal };
  }

  #show({ value, age, status, signal }) {
    const { recorder, bus } = this.owner;
    const series = recorder.of(signal.signal);
    const state = bus.nodes.get(signal.node)?.state;
    const isOld = signal.tpdo != null && state !== "operational";
    const since = series.t.length ? Math.max(0, recorder.t - series.t.at(-1)) : null;
    text(age, since == null ? "-" : seconds(since, since < 10 ? 2 : 0));
    if (series.newest === undefined && !isOld) {
      text(status, signal.tpdo == null ? "not read yet" : `TPDO ${signal.tpdo} has not come: it is sent on its events (type, event timer)`);
      return;
    }
    text(value, isOld ? "-" : quantity(series.newest, signal.unit));
    const status_ = recorder.series.get(statusKey(signal))?.meaning ?? null;
    const words = isOld ? `not sent: ${state ?? "not heard"}` : (series.meaning ?? status_ ?? (series.newest == null ? "not valid" : "ok"));
    text(status, words);
    set(status, "data-kind", ["ok", "valid"].includes(words) ? "good" : "bad");
  }
}

/** The signals with their names: with the node, if they are of several nodes. */
export function named(signals) {
  const isOfSeveral = new Set(signals.map(({ node }) => node)).size > 1;
  return signals.map((signal) => ({ ...signal, label: isOfSeveral ? `${signal.node}: ${signal.name}` : signal.name }));
}

/** The status of a process value of CiA 404 (6150h), which is read where no PDO carries it; `null` for any other signal. */
export function statusKey({ node, index, sub }) {
  const isSecondDevice = (index & 0x800) !== 0;
  const isProcessValue = [0x6130, 0x7130, 0x9130].includes(index & ~0x800);
  return isProcessValue ? signalKey(node, isSecondDevice ? 0x6950 : 0x6150, sub) : null;
}
