// Configuration files: saving the node's configuration as a DCF, and writing a DCF to the node.

import { button, el, field } from "../dom.js";
import { offer } from "../file.js";
import { address, hex } from "../format.js";
import { outcome } from "../outcome.js";

export function dcfTools(bus, onApplied) {
  const result = outcome();
  const plan = el("div");
  const steps = ({ done, all }) => result.busy(`${done} of ${all} objects`);
  const down = (all) => save(bus, all, result, steps);
  const file = el("input", { type: "file", accept: ".dcf,.eds,.txt" });
  file.addEventListener("change", () => file.files[0] && compare(bus, file.files[0], { result, plan, steps, onApplied }));
  return el("details", { class: "box" }, el("summary", {}, "Configuration file (DCF)"),
    el("div", { class: "bar" }, button("Save what differs", () => down(false)), button("Save all", () => down(true)), field("Apply a file", file)),
    result.line, plan);
}

async function save(bus, all, result, steps) {
  const file = await result.of("reading the node", bus.request("dcf", { node: bus.chosen, all }, steps), ({ name }) => `${name} is saved`);
  if (file) offer(file.name, file.text);
}

/** Shows the changes first; nothing is written before the user has seen them. */
async function compare(bus, file, { result, plan, steps, onApplied }) {
  const keys = { node: bus.chosen, text: await file.text() };
  plan.replaceChildren();
  const said = ({ changes, warnings }) => [changes.length ? `${objects(changes.length)} would change` : "the node is configured like this already", ...warnings].join("; warning: ");
  const answer = await result.of(`comparing ${file.name}`, bus.request("apply", { ...keys, dry_run: true }, steps), said);
  if (!answer?.changes.length) return;
  const store = el("input", { type: "checkbox" });
  const apply = async () => {
    const done = await result.of("writing", bus.request("apply", { ...keys, save: store.checked }, steps), ({ changed, saved }) => `${objects(changed)} changed${saved ? ", saved" : ""}`);
    if (done) (plan.replaceChildren(), onApplied());
  };
  plan.append(changeTable(answer.changes), el("div", { class: "bar" }, el("label", {}, store, " save in the node"), button("Write these", apply)));
}

function objects(count) {
  return count === 1 ? "1 object" : `${count} objects`;
}

function changeTable(changes) {
  const number = (value) => el("td", { class: "number" }, value > 0xFFFF && Number.isInteger(value) ? `${value} (${hex(value)})` : String(value ?? "-"));
  const rows = changes.map(({ index, sub, path, present, value }) => el("tr", {}, el("th", { scope: "row" }, address(index, sub)), el("td", {}, path), number(present), number(value)));
  const head = el("tr", {}, ["Object", "Name", "Present", "New"].map((name) => el("th", { scope: "col" }, name)));
  return el("div", { class: "wide" }, el("table", {}, el("caption", {}, "Changes"), el("thead", {}, head), el("tbody", {}, rows)));
}
