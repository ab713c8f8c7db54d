// Checks of a typed value before it is sent. The server checks again.

import { parseNumber } from "../format.js";

const INTEGER = /^(UNSIGNED|INTEGER)(\d+)$/;

/** Why a node would refuse the typed value, in words; `null` where no reason is known. */
export function check(entry, typed) {
  if (!isWritable(entry)) return "This object cannot be written.";
  if (/STRING|DOMAIN/.test(entry.type)) return null;
  if (entry.type === "BOOLEAN") return /^(0|1|true|false)$/i.test(typed.trim()) ? null : "0 or 1 is wanted.";
  // Words, and numbers in a unit that another object selects: only the server knows their number.
  if (/^[a-z]/i.test(typed.trim()) || /^[0-9A-F]{4}h/.test(entry.unit ?? "")) return null;
  const value = parseNumber(typed);
  if (value == null) return "A number is wanted, as 12, -3.5 or 1Fh.";
  return checkRange(entry, value);
}

export function isWritable({ access }) {
  return !["ro", "const"].includes(access);
}

export function isReadable({ access }) {
  return access !== "wo";
}

function checkRange(entry, value) {
  const { low, high } = limits(entry);
  if (INTEGER.test(entry.type) && !Number.isInteger(value)) return "A whole number is wanted.";
  if (low != null && value < low) return `Too low: ${rangeText(entry)} is wanted.`;
  if (high != null && value > high) return `Too high: ${rangeText(entry)} is wanted.`;
  return null;
}

/** The range in the data sheet, else the range of the type. */
function limits({ low, high, type }) {
  const [, sign, bits] = INTEGER.exec(type) ?? [];
  if (!bits) return { low, high };
  const size = 2 ** Number(bits);
  const [least, greatest] = sign === "UNSIGNED" ? [0, size - 1] : [-size / 2, size / 2 - 1];
  return { low: low ?? least, high: high ?? greatest };
}

/** The limits of an object: `0 to 38`; empty where only the type limits the value. */
export function rangeText(entry) {
  const { low, high } = entry.low == null && entry.high == null ? limits(entry) : entry;
  if (low != null && high != null) return `${low} to ${high}`;
  if (low != null) return `${low} and more`;
  return high != null ? `up to ${high}` : "";
}
