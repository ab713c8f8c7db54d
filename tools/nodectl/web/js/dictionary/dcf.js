// Configuration files: saving the node's configuration as a DCF, and writing a DCF to the node.

import { button, el, field } from "../dom.js";
import { offer } from "../file.js";
import { address } from "../format.js";
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
  const said = ({ steps, warnings }) => [steps.length ? `${steps.length} objects would be written` : "the node is configured like this already", ...warnings].join("; warning: ");
  const answer = await result.of(`comparing ${file.name}`, bus.request("apply", { ...keys, dry_run: true }, steps), said);
  if (!answer?.steps.length) return;
  const store = el("input", { type: "checkbox" });
  const apply = async () => {
    const done = await result.of("writing", bus.request("apply", { ...keys, save: store.checked }, steps), ({ writes, saved }) => `${writes} objects written${saved ? ", saved" : ""}`);
    if (done) (plan.replaceChildren(), onApplied());
  };
  plan.append(stepTable(answer.steps), el("div", { class: "bar" }, el("label", {}, store, " save in the node"), button("Write these", apply)));
}

function stepTable(steps) {
  const rows = steps.map(({ index, sub, path, value }) => el("tr", {}, el("th", { scope: "row" }, address(index, sub)), el("td", {}, path), el("td", { class: "number" }, String(value))));
  const head = el("tr", {}, ["Object", "Name", "Value"].map((name) => el("th", { scope: "col" }, name)));
  return el("div", { class: "wide" }, el("table", {}, el("caption", {}, "What would be written"), el("thead", {}, head), el("tbody", {}, rows)));
}
