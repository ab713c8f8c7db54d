// Update: a new program for a node. The results of all checks are shown before anything is erased.

import { button, el, field, set, text } from "../dom.js";
import { base64 } from "../file.js";
import { hex } from "../format.js";
import { outcome } from "../outcome.js";
import { nodeChoice } from "../parts/node_choice.js";
import { Programs } from "../update/programs.js";

export function update(bus) {
  const view = new Update(bus);
  return { name: "update", title: "Update", content: view.content, show: () => view.show(), hide: () => view.hide() };
}

class Update {
  constructor(bus) {
    Object.assign(this, { bus, known: new Map(), inspected: null, isShown: false });
    this.result = outcome();
    this.checks = el("ul", { class: "checks", "aria-label": "Checks" });
    this.versions = el("p");
    this.bar = el("progress", { max: 1, "aria-label": "Progress of the update" });
    this.step = el("p", { role: "status" });
    this.back = el("div");
    this.programs = new Programs(bus);
    this.content = this.#layout();
    bus.connection.on("update", (event) => event.node === bus.chosen && this.#progress(event));
    bus.on("chosen", () => this.#clear());
    for (const event of ["chosen", "connected"]) bus.on(event, () => this.isShown && this.programs.show());
    // A node that has just come has no personality yet.
    let personality = null;
    bus.on("nodes", () => personality !== (personality = bus.node()?.personality) && this.isShown && this.programs.show());
  }

  show() {
    this.isShown = true;
    return this.programs.show();
  }

  hide() {
    this.isShown = false;
  }

  #layout() {
    this.file = el("input", { type: "file", accept: ".img" });
    this.file.addEventListener("change", () => this.file.files[0] && this.#read(this.file.files[0]));
    this.force = el("input", { type: "checkbox", on: { change: () => this.#offer() } });
    this.startButton = button("Update the node", () => this.#start(), { disabled: true });
    set(this.bar, "hidden", true);
    return el("div", {}, el("div", { class: "bar" }, nodeChoice(this.bus), field("Program", this.file, "a signed image, as firmware.img")),
      this.versions, this.checks, el("div", { class: "bar" }, el("label", {}, this.force, " also an older one, or the same again"), this.startButton),
      this.bar, this.step, this.result.line, this.back, this.programs.element);
  }

  async #read(file) {
    await this.#inspect({ name: file.name, data: await base64(file) });
  }

  /** Lets the server check a file. Nothing is changed. */
  async #inspect(file) {
    this.#clear();
    const keys = { node: this.bus.chosen, name: file.name, data: file.data };
    const answer = await this.result.of("checking", this.bus.request("update.inspect", keys), "the program fits: nothing is changed yet");
    if (!answer) return;
    if (!answer.allowed) this.result.bad("the program does not fit: nothing is changed");
    this.inspected = answer;
    if (answer.image) this.known.set(answer.image.identification, { ...file, version: answer.image.version });
    text(this.versions, `In the node: ${program(answer.device)}. In the file: ${answer.image ? program(answer.image) : "no program"}.`);
    this.checks.replaceChildren(...answer.checks.map(({ name, ok, text: words }) => el("li", { data: { kind: ok ? "good" : "bad" } }, el("strong", {}, `${name}: ${ok ? "good" : "bad"}. `), words)));
    this.#offer();
  }

  #offer() {
    const isAllowed = this.inspected && (this.inspected.allowed || (this.force.checked && this.inspected.image));
    set(this.startButton, "disabled", !isAllowed);
  }

  async #start() {
    set(this.startButton, "disabled", true);
    set(this.bar, "hidden", null);
    const keys = { node: this.bus.chosen, file: this.inspected.file, force: this.force.checked };
    const answer = await this.result.of("updating: do not take the power away", this.bus.request("update.start", keys), (done) => (done.result === "unchanged" ? "the node runs this program already" : `updated: ${of(done, "old")}, is now ${of(done, "new")}`));
    set(this.bar, "hidden", true);
    text(this.step, "");
    if (answer) this.#offerBack(answer);
    this.#offer();
    await this.programs.show();
  }

  #progress({ step, text: words, done, all }) {
    if (step === "done" || step === "failed") return;
    set(this.bar, "hidden", null);
    if (all) Object.assign(this.bar, { max: all, value: done });
    else this.bar.removeAttribute("value");
    text(this.step, all ? `${words}: ${done} of ${all}` : words);
  }

  /** The former program can be put back when its file was chosen on this page. */
  #offerBack({ result, old_identification: old, old_version: version }) {
    this.back.replaceChildren();
    if (result !== "updated") return;
    const file = this.known.get(old);
    if (!file) return this.back.append(el("p", { class: "hint" }, `To go back to version ${version}, choose its file.`));
    const revert = async () => {
      this.force.checked = true;
      await this.#inspect(file);
      await this.#start();
    };
    this.back.append(button(`Put back ${file.name}`, revert));
  }

  #clear() {
    this.inspected = null;
    this.checks.replaceChildren();
    this.back.replaceChildren();
    text(this.versions, "");
    this.result.clear();
    this.#offer();
  }
}

/** The old or the new program of an update. */
function of(done, which) {
  return program({ version: done[`${which}_version`], identification: done[`${which}_identification`] });
}

function program({ version, identification, bytes }) {
  return `version ${version ?? "unknown"}, identification ${hex(identification)}${bytes ? `, ${bytes} bytes` : ""}`;
}
