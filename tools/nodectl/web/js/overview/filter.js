// The selection of the nodes that the overview lists, and their number by state.

import { nameOf, stateOf } from "./row.js";

export const SETS = [
  ["all", "all nodes"],
  ["operational", "operational"],
  ["idle", "not operational"],
  ["emcy", "with an active EMCY"],
  ["gone", "not heard any more"],
];

const IN_SET = {
  all: () => true,
  operational: ({ alive, state }) => alive && state === "operational",
  idle: ({ alive, state }) => alive && state !== "operational",
  emcy: ({ emcy }) => emcy?.active ?? false,
  gone: ({ alive }) => !alive,
};

/** Whether a node is in a set and has every word of the search in its node-ID, name, personality or state. */
export function isWanted(node, set, search) {
  const words = `${node.node} ${nameOf(node)} ${node.personality ?? ""} ${stateOf(node)}`.toLowerCase();
  return IN_SET[set](node) && search.toLowerCase().split(/\s+/).every((word) => words.includes(word));
}

/** `127 nodes: 120 operational, 5 not operational, 2 not heard any more; 1 with an active EMCY`. */
export function summary(nodes) {
  const count = (set) => nodes.filter(IN_SET[set]).length;
  const states = SETS.filter(([set]) => ["operational", "idle", "gone"].includes(set)).map(([set, label]) => [count(set), label]);
  const parts = states.filter(([number]) => number > 0).map(([number, label]) => `${number} ${label}`);
  const faulty = count("emcy");
  return `${nodes.length} node${nodes.length === 1 ? "" : "s"}: ${parts.join(", ")}${faulty ? `; ${faulty} with an active EMCY` : ""}`;
}
