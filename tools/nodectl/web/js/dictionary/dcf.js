// Configuration files: saving the node's configuration as a DCF, and writing a DCF to the node.

import { button, el, field } from "../dom.js";
import { offer, textOf } from "../file.js";
import { address, hex } from "../format.js";
import { outcome } from "../outcome.js";

/** The number of warnings that are shown. */
const WARNINGS = 5;

export function dcfTools(bus, onApplied) {
  const result = outcome();
  const plan = el("div");
  const steps = ({ done, all }) => result.busy(`${done} of ${all} objects`);
  const down = (all) => save(bus, all, result, steps);
  // A file that was corrected may be chosen again.
  const file = el("input", { type: "file", accept: ".dcf,.eds,.txt", on: { click: () => { file.value = ""; } } });
  file.addEventListener("change", () => file.files[0] && compare(bus, file.files[0], { result, plan, steps, onApplied }));
  // The changes are those of one node.
  bus.on("chosen", () => (plan.replaceChildren(), result.clear()));
  return el("details", { class: "box" }, el("summary", {}, "Configuration file (DCF)"),
    el("div", { class: "bar" }, button("Save what differs", () => down(false)), button("Save all", () => down(true)), field("Apply a file", file)),
    result.line, plan);
}

async function save(bus, all, result, steps) {
  const file = await result.of("reading the node", bus.request("dcf", { node: bus.chosen, all }, steps), saved);
  if (file) offer(file.name, file.text);
}

function saved({ name, left_out: out }) {
  return out.length ? `${name} is saved without ${out.join(", ")}: a file cannot have these texts` : `${name} is saved`;
}

/** Shows the changes first; nothing is written before the user has seen them. */
async function compare(bus, file, { result, plan, steps, onApplied }) {
  const node = bus.chosen;
  plan.replaceChildren();
  const text = await result.of(`reading ${file.name}`, textOf(file, bus.connection.largest, "a configuration file (DCF)"), "");
  if (text === undefined) return;
  const keys = { node, text };
  const said = ({ changes }) => (changes.length ? `${objects(changes.length)} would change` : "the node is configured like this already");
  const answer = await result.of(`comparing ${file.name}`, bus.request("apply", { ...keys, dry_run: true }, steps), said);
  if (!answer) return;
  if (bus.chosen !== keys.node) return result.clear();
  if (answer.warnings.length) plan.append(warningList(answer.warnings));
  if (!answer.changes.length) return;
  const store = el("input", { type: "checkbox" });
  const apply = async () => {
    const done = await result.of("writing", bus.request("apply", { ...keys, save: store.checked }, steps), ({ changed, saved }) => `${objects(changed)} changed${saved ? ", saved" : ""}`);
    if (done) (plan.replaceChildren(), onApplied());
  };
  plan.append(changeTable(answer.changes), el("div", { class: "bar" }, el("label", { class: "switch" }, store, " save in the node"), button("Write these", apply)));
}

function objects(count) {
  return count === 1 ? "1 object" : `${count} objects`;
}

function warningList(warnings) {
  const more = warnings.length > WARNINGS ? [`and ${warnings.length - WARNINGS} more warnings`] : [];
  return el("ul", { data: { kind: "warn" } }, [...warnings.slice(0, WARNINGS).map((warning) => `warning: ${warning}`), ...more].map((line) => el("li", {}, line)));
}

function changeTable(changes) {
  const number = (value) => el("td", { class: "number" }, value > 0xFFFF && Number.isInteger(value) ? `${value} (${hex(value)})` : String(value ?? "-"));
  const rows = changes.map(({ index, sub, path, present, value }) => el("tr", {}, el("th", { scope: "row" }, address(index, sub)), el("td", {}, path), number(present), number(value)));
  const head = el("tr", {}, ["Object", "Name", "Present", "New"].map((name, column) => el("th", { scope: "col", class: column > 1 && "number" }, name)));
  return el("div", { class: "wide" }, el("table", { class: "changes" }, el("caption", {}, "Changes"), el("thead", {}, head), el("tbody", {}, rows)));
}
