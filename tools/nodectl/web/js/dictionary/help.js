// The purpose of objects, in a sentence each. A data sheet has no place for such texts.

import { COMMUNICATION } from "./texts/communication.js";
import { ENCODER } from "./texts/encoder.js";
import { LIFT } from "./texts/lift.js";
import { NODE } from "./texts/node.js";
import { PRESSURE } from "./texts/pressure.js";

const PDO = [
  [0x1400, 0x15ff, "When an RPDO is taken over, and from which CAN-ID. Bit 31 of the COB-ID switches the PDO off."],
  [0x1600, 0x17ff, "The objects that an RPDO writes. Commissioning changes a mapping in the five steps that CiA 301 wants."],
  [0x1800, 0x19ff, "When a TPDO is sent, and with which CAN-ID. Bit 31 of the COB-ID switches the PDO off. Type 0 to 240 by SYNC, 254 by event timer, 255 with changes as well."],
  [0x1a00, 0x1bff, "The objects that a TPDO carries. Commissioning changes a mapping in the five steps that CiA 301 wants."],
];

/** In a module of two devices the transmitter is the second one: its profile objects are 800h higher. */
const SECOND_DEVICE = 0x800;

const PROFILES = {
  pressure: (index) => PRESSURE[index],
  encoder: (index) => cam(index) ?? ENCODER[index],
  combined: (index) => cam(index) ?? ENCODER[index] ?? PRESSURE[index - SECOND_DEVICE] ?? PRESSURE[index],
  lift: (index) => LIFT[index],
};

/** A sentence about an object; empty where there is none. */
export function help({ index }, personality) {
  const pdo = PDO.find(([first, last]) => index >= first && index <= last);
  return COMMUNICATION[index] ?? pdo?.[2] ?? NODE[index] ?? PROFILES[personality]?.(index) ?? "";
}

function cam(index) {
  if (index >= 0x6310 && index < 0x6318) return "Where the cam goes on.";
  if (index >= 0x6320 && index < 0x6328) return "Where the cam goes off.";
  return index >= 0x6330 && index < 0x6338 ? "How far the position has to go back before the cam changes." : undefined;
}
