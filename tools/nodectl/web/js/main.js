// The start: connection, navigation, keys.

import { Bus } from "./bus.js";
import { Connection, tokenOf } from "./connection.js";
import { showHelp } from "./help.js";
import { Navigation } from "./navigation.js";
import { showStatus } from "./top.js";
import { Recorder } from "./plot/recorder.js";
import { commissioning } from "./views/commissioning.js";
import { dictionary } from "./views/dictionary.js";
import { live } from "./views/live.js";
import { overview } from "./views/overview.js";
import { stimuli } from "./views/stimuli.js";
import { trace } from "./views/trace.js";
import { update } from "./views/update.js";

const connection = new Connection(tokenOf(document));
const bus = new Bus(connection);
const recorder = new Recorder(bus);
const plots = live(bus, recorder);
const navigation = new Navigation([
  overview(bus),
  plots,
  dictionary(bus, recorder),
  trace(bus),
  commissioning(bus, recorder),
  update(bus),
  stimuli(bus),
]);

showStatus(bus);
bus.on("hello", ({ simulator }) => navigation.offer("stimuli", simulator));
document.addEventListener("keydown", onKey);
connection.start();

function onKey(event) {
  const isTyping = event.target.closest("input:not([type=checkbox]):not([type=range]), textarea, select, dialog");
  if (isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.key === "?") showHelp(navigation);
  else if (event.key === "/") navigation.search();
  else if (/^[1-9]$/.test(event.key)) navigation.showAt(Number(event.key) - 1);
  else return;
  event.preventDefault();
}

// For the console of the browser, for scripts in it, and for the tests.
window.canopen = { bus, recorder, time: plots.time };
