// Commissioning: LSS, PDO mapping, and the settings of each personality before its use.

import { el, set, text } from "../dom.js";
import { Encoder } from "../commissioning/encoder.js";
import { Lift } from "../commissioning/lift.js";
import { lss } from "../commissioning/lss.js";
import { Mapping } from "../commissioning/mapping.js";
import { Pressure } from "../commissioning/pressure.js";
import { nodeChoice } from "../parts/node_choice.js";

const FRAME_MS = 100;

export function commissioning(bus, recorder) {
  const view = new Commissioning(bus, recorder);
  return { name: "commissioning", title: "Commissioning", content: view.content, show: () => view.show(), hide: () => view.hide() };
}

class Commissioning {
  constructor(bus, recorder) {
    Object.assign(this, { bus, recorder, isShown: false, shown: [] });
    this.mapping = new Mapping(bus);
    this.panels = [[Pressure, new Pressure(bus, recorder)], [Encoder, new Encoder(bus, recorder)], [Lift, new Lift(bus, recorder)]];
    this.error = el("p", { class: "outcome", "data-kind": "bad", role: "status" });
    this.hint = el("p", { class: "hint", role: "status" });
    this.content = el("div", {}, el("div", { class: "bar" }, nodeChoice(bus)), this.error, this.hint, ...this.panels.map(([, panel]) => panel.element), this.mapping.element, lss(bus));
    bus.on("chosen", () => this.isShown && this.show());
    bus.on("connected", () => this.isShown && this.show());
    // A node has no personality before it is identified, and may have another one after a restart.
    let personality = null;
    bus.on("nodes", () => personality !== (personality = bus.node()?.personality) && this.isShown && this.show());
    bus.connection.on("mapping", ({ node }) => node === bus.chosen && this.isShown && this.mapping.refresh().catch((error) => text(this.error, error.message)));
  }

  async show() {
    const wasShown = this.isShown;
    this.isShown = true;
    const personality = this.bus.node()?.personality;
    for (const [kind, panel] of this.panels) set(panel.element, "hidden", !kind.isFor(personality));
    this.shown = this.panels.filter(([kind]) => kind.isFor(personality)).map(([, panel]) => panel);
    if (this.bus.chosen != null && this.bus.connection.connected) await this.#load([...this.shown, this.mapping]);
    if (!wasShown) this.#tick();
  }

  hide() {
    this.isShown = false;
    this.recorder.want("commissioning", []).catch(() => {});
  }

  async #load(panels) {
    try {
      for (const panel of panels) await panel.show();
      await this.recorder.want("commissioning", this.shown.flatMap(({ keys }) => keys), true);
      text(this.error, "");
    } catch (error) {
      text(this.error, error.message);
    }
  }

  #tick() {
    if (!this.isShown) return;
    for (const panel of this.shown) if (panel.keys.every(Boolean)) panel.draw();
    text(this.hint, this.shown.length > 0 ? reason(this.bus.node()) : "");
    setTimeout(() => requestAnimationFrame(() => this.#tick()), FRAME_MS);
  }
}

/** Why a node has no values; empty if it has. */
function reason(node) {
  if (!node) return "";
  if (!node.alive) return "No values: the node is not heard any more.";
  return node.state === "stopped" ? "No values: the node is stopped. Start it in the overview." : "";
}
