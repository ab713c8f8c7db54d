// The selection of the objects that are shown.

import { address } from "../format.js";
import { isWritable } from "./check.js";

export const SETS = [
  ["all", "all objects"],
  ["favourites", "favourites"],
  ["writable", "those that can be written"],
  ["differs", "those that differ from the default"],
  ["tpdo", "those that a TPDO can carry"],
  ["rpdo", "those that an RPDO can write"],
];

export const keyOf = ({ index, sub }) => `${index}:${sub}`;

/** Whether an object has every word of the search in its name or its address. */
export function matches(entry, search) {
  const text = `${address(entry.index, entry.sub)} ${address(entry.index)} ${entry.path}`.toLowerCase();
  return search.toLowerCase().split(/\s+/).every((word) => text.includes(word.replace(/^0x/, "")));
}

/** Whether an object belongs to a set. */
export function isIn(entry, set, { favourites, differing }) {
  switch (set) {
    case "favourites": return favourites.has(keyOf(entry));
    case "writable": return isWritable(entry);
    case "differs": return differing.has(keyOf(entry));
    case "tpdo": return entry.tpdo;
    case "rpdo": return entry.rpdo;
    default: return true;
  }
}
