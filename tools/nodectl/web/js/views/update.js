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
    Object.assign(this, { bus, known: new Map(), chosen: null, inspected: null, ticket: null, running: new Map(), own: new Set(), isShown: false });
    this.result = outcome();
    this.checks = el("ul", { class: "checks", "aria-label": "Checks" });
    this.versions = el("p");
    this.bar = el("progress", { max: 1, "aria-label": "Progress of the update" });
    this.step = el("p", { role: "status" });
    this.back = el("div");
    this.programs = new Programs(bus);
    this.content = this.#layout();
    bus.connection.on("update", (event) => this.#progress(event));
    bus.on("connected", () => this.running.clear());
    // The checks are those of one node, and a new connection has no files.
    for (const event of ["chosen", "connected"]) bus.on(event, () => (this.#clear(), this.#showProgress(), this.isShown && this.show()));
    // A node that has just come has no personality yet.
    let personality = null;
    bus.on("nodes", () => personality !== (personality = bus.node()?.personality) && this.isShown && this.programs.show());
  }

  async show() {
    this.isShown = true;
    if (this.chosen && !this.inspected && !this.ticket && this.bus.connection.connected && !this.running.has(this.bus.chosen)) await this.#inspect(this.chosen);
    await this.programs.show();
  }

  hide() {
    this.isShown = false;
  }

  #layout() {
    // A browser reports the choice of the same file only if there is none before.
    this.file = el("input", { type: "file", accept: ".img", on: { click: () => { this.file.value = ""; } } });
    this.file.addEventListener("change", () => this.file.files[0] && this.#read(this.file.files[0]));
    this.force = el("input", { type: "checkbox", on: { change: () => this.#offer() } });
    this.startButton = button("Update the node", () => this.#start(), { disabled: true });
    set(this.bar, "hidden", true);
    return el("div", {}, el("div", { class: "bar" }, nodeChoice(this.bus), field("Program", this.file, "a signed image, as firmware.img")),
      this.versions, this.checks, el("div", { class: "bar" }, el("label", {}, this.force, " also an older one, or the same again"), this.startButton),
      this.bar, this.step, this.result.line, this.back, this.programs.element);
  }

  async #read(file) {
    this.#clear();
    this.chosen = null;
    try {
      this.chosen = { name: file.name, data: await base64(file, this.bus.connection.largest, "a signed image, as firmware.img") };
    } catch (error) {
      return this.result.bad(error);
    }
    await this.#inspect(this.chosen);
  }

  /** Lets the server check a file for the chosen node. Nothing is changed. */
  async #inspect(file) {
    this.#clear();
    const ticket = (this.ticket = {});
    this.result.busy("checking");
    try {
      const answer = await this.#ask(file, this.bus.chosen);
      if (this.ticket === ticket) this.#show(file, answer);
    } catch (error) {
      if (this.ticket === ticket) (this.#clear(), this.result.bad(error));
    }
  }

  #ask({ name, data }, node) {
    return this.bus.request("update.inspect", { node, name, data });
  }

  #show(file, answer) {
    this.ticket = null;
    this.inspected = { ...answer, source: file };
    if (answer.allowed) this.result.good("the program fits: nothing is changed yet");
    else this.result.bad("the program does not fit: nothing is changed");
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
    const { inspected, bus: { chosen: node } } = this;
    if (!inspected) return;
    set(this.startButton, "disabled", true);
    this.result.busy("updating: do not take the power away");
    // The user may look at another node meanwhile.
    const isShown = () => this.bus.chosen === node;
    const named = (words) => (isShown() ? words : `node ${node}: ${words}`);
    this.own.add(node);
    try {
      const done = await this.#update(node, inspected);
      this.result.good(named(done.result === "unchanged" ? "the node runs this program already" : `updated: ${of(done, "old")}, is now ${of(done, "new")}`));
      if (isShown()) this.#offerBack(done);
    } catch (error) {
      this.result.bad(named(error.message));
    }
    this.own.delete(node);
    if (isShown()) this.inspected ??= inspected;
    this.#offer();
    await this.programs.show();
  }

  /** The server keeps a file for one update. */
  async #update(node, inspected) {
    const { file } = inspected.isUsed ? await this.#ask(inspected.source, node) : inspected;
    inspected.isUsed = true;
    return this.bus.request("update.start", { node, file, force: this.force.checked });
  }

  #progress(event) {
    const { node, step } = event;
    const isOver = step === "done" || step === "failed";
    if (isOver) this.running.delete(node);
    else this.running.set(node, event);
    if (node !== this.bus.chosen) return;
    this.#showProgress();
    // The result of an update of this page stays on display.
    if (isOver && this.isShown && !this.own.has(node)) this.show();
  }

  /** The progress of the chosen node. */
  #showProgress() {
    const event = this.running.get(this.bus.chosen);
    set(this.bar, "hidden", !event);
    if (event?.all) Object.assign(this.bar, { max: event.all, value: event.done });
    else this.bar.removeAttribute("value");
    text(this.step, event?.all ? `${event.text}: ${event.done} of ${event.all}` : event?.text ?? "");
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
    Object.assign(this, { inspected: null, ticket: null });
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
