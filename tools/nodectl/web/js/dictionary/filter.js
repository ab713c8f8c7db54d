// The selection of the objects that are shown.

import { address } from "../format.js";
import { AREAS } from "./areas.js";
import { isWritable } from "./check.js";

export const SETS = [
  ["all", "all objects"],
  ["communication", "communication (1000h to 13FFh)"],
  ["pdo", "PDO parameters (1400h to 1BFFh)"],
  ["network", "network and program (1C00h to 1FFFh)"],
  ["manufacturer", "manufacturer (2000h to 5FFFh)"],
  ["profile", "device profile (6000h and up)"],
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
  const area = AREAS.find(([name]) => name === set);
  if (area) return entry.index >= area[2] && entry.index <= area[3];
  switch (set) {
    case "favourites": return favourites.has(keyOf(entry));
    case "writable": return isWritable(entry);
    case "differs": return differing.has(keyOf(entry));
    case "tpdo": return entry.tpdo;
    case "rpdo": return entry.rpdo;
    default: return true;
  }
}
