// Numbers and names in the notation of the field.

/** 6130h, or 6130h:1 with a sub-index. */
export function address(index, sub = null) {
  const digits = index.toString(16).toUpperCase().padStart(4, "0");
  return sub == null ? `${digits}h` : `${digits}h:${sub}`;
}

/** A number in so many hexadecimal digits: 00020194h. */
export function hex(number, digits = 8) {
  return number == null ? "-" : `${number.toString(16).toUpperCase().padStart(digits, "0")}h`;
}

/** The key of a signal in the protocol. */
export function signalKey(node, index, sub) {
  return `${node}:${index.toString(16).toUpperCase().padStart(4, "0")}:${sub}`;
}

/** A value with its unit; REAL32 has seven significant digits. */
export function quantity(value, unit = "") {
  if (value == null) return "no valid value";
  const shown = typeof value === "number" ? number(value) : value;
  return unit ? `${shown} ${unit}` : shown;
}

/** A number without the digits beyond the precision of REAL32. */
export function number(value) {
  return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(7)));
}

/** Seconds of the bus. */
export function seconds(t, digits = 3) {
  return t == null ? "-" : `${t.toFixed(digits)} s`;
}

/** A share of the whole: 3.1 %. */
export function percent(share) {
  return share == null ? "-" : `${(share * 100).toFixed(1)} %`;
}

/** Bytes of hexadecimal pairs with a space between them. */
export function bytes(pairs) {
  return (pairs.match(/../g) ?? []).join(" ").toUpperCase();
}

/** A number as a person types it: 12, -3.5, 0x1F, 1Fh. `null` for anything else. */
export function parseNumber(typed) {
  const text = typed.trim();
  if (/^0x[0-9a-f]+$/i.test(text)) return Number.parseInt(text, 16);
  if (/^[0-9][0-9a-f]*h$/i.test(text)) return Number.parseInt(text, 16);
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text)) return null;
  return Number(text);
}
