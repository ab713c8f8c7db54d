// The inputs of a board that each personality reads (docs/personalities.md).

const PRESSURE = ["pressure", "temperature", "thermistor"];
const POSITION = ["shaft", "ssi", "button"];

/** The load measuring unit of a lift reads the pressure with its temperature. */
const INPUTS = { pressure: PRESSURE, encoder: POSITION, combined: [...PRESSURE, ...POSITION], lift: [...PRESSURE, ...POSITION] };

/** The input at which a fault is. A fault of supply, battery or clock concerns every personality. */
const OF_FAULT = {
  "open-sensor": "pressure",
  "rail-high": "pressure",
  "rail-low": "pressure",
  "open-thermistor": "thermistor",
  "shorted-thermistor": "thermistor",
  "missing-index": "shaft",
  bounce: "shaft",
  "open-ssi": "ssi",
  "wrong-code": "ssi",
  "ssi-error": "ssi",
  "ssi-parity": "ssi",
};

/** Whether a personality reads an input. An unknown personality may read every input. */
export function reads(personality, input) {
  const isOfSome = PRESSURE.includes(input) || POSITION.includes(input);
  return !isOfSome || (INPUTS[personality]?.includes(input) ?? true);
}

/** Whether a fault has an effect on a personality. */
export function hasEffect(personality, fault) {
  return reads(personality, OF_FAULT[fault]);
}
