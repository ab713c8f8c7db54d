// The first line: the bus, its load, and the state of the connection.

import { announce } from "./announce.js";
import { el, set, text } from "./dom.js";
import { percent, seconds } from "./format.js";

const FACTS = [
  ["Bit rate", ({ bit_rate }) => (bit_rate == null ? "-" : `${bit_rate} kbit/s`)],
  ["Load", ({ load }) => percent(load)],
  ["Frames", ({ frames }) => `${frames}/s`],
  ["Time", ({ t }) => seconds(t, 0)],
  ["Pages", ({ pages }) => String(pages)],
];

export function showStatus(bus) {
  const values = FACTS.map(([name]) => addFact(name));
  const line = document.getElementById("connection");
  const show = () => {
    if (bus.status) FACTS.forEach(([, of], i) => text(values[i], of(bus.status)));
    showConnection(line, bus);
  };
  bus.on("status", show);
  bus.on("connected", show);
  bus.on("hello", (hello) => {
    text(document.getElementById("bus-name"), hello.bus);
    show();
  });
  show();
}

function addFact(name) {
  const value = el("dd", {}, "-");
  document.getElementById("bus-status").append(el("div", { data: { fact: name } }, el("dt", {}, name), value));
  return value;
}

function showConnection(line, bus) {
  const [kind, sentence] = connectionOf(bus);
  set(line, "data-kind", kind);
  if (line.textContent === sentence) return;
  text(line, sentence);
  if (kind === "bad") announce(sentence);
}

function connectionOf({ connection, hello, status }) {
  if (!connection.connected) return ["bad", hello ? "no server: trying again" : "connecting"];
  if (status && !status.open) return ["bad", `bus lost: ${status.reason}`];
  return hello.writes ? ["good", "connected"] : ["warn", "connected, read only"];
}
