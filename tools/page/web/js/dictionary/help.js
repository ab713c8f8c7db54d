// What objects are for, in a sentence each: the communication profile (CiA 301) and the profiles of this project's nodes. A data sheet has no
// place for it.

const COMMUNICATION = {
  0x1000: "The profile of the device (low word) and what it is by that profile (high word).",
  0x1001: "What is wrong now, a bit for each kind. Bit 0 is set with every error.",
  0x1003: "The newest errors first, with their emergency codes. Write 0 to sub-index 0 to clear the list.",
  0x1005: "CAN-ID of SYNC.",
  0x1006: "Time between two SYNC messages, where the node sends them.",
  0x1007: "Time after SYNC in which synchronous PDOs are sent.",
  0x1010: "Saves parameters: the signature \"save\" (65766173h) is wanted. The overview has a button for it.",
  0x1011: "Puts back the defaults at the next reset: the signature \"load\" (64616F6Ch) is wanted.",
  0x1014: "CAN-ID of emergencies.",
  0x1015: "Least time between two emergencies.",
  0x1016: "Nodes whose heartbeat is watched: node-ID in bits 16 to 23, time in ms in bits 0 to 15.",
  0x1017: "Time between two heartbeats. 0 switches the heartbeat off.",
  0x1018: "Who made the device and which one of them it is. LSS finds a node by these four numbers.",
  0x1019: "How far SYNC counts. 0: SYNC has no counter.",
  0x1029: "What an error does to the NMT state: 0 pre-operational, 1 nothing, 2 stopped.",
  0x1f51: "Starts (1), stops (0) and erases (3) the program. The view Update does it in the right order.",
  0x1f56: "CRC-32 of the program, by which two versions are told apart.",
  0x1f57: "What the flash is doing, and what went wrong there.",
  0x1f80: "8: the node goes on to Operational by itself when it has measured.",
};

const PDO = [
  [0x1400, 0x15ff, "When an RPDO is taken over, and from which CAN-ID. Bit 31 of the COB-ID switches the PDO off."],
  [0x1600, 0x17ff, "The objects that an RPDO writes. Commissioning changes a mapping in the five steps that CiA 301 wants."],
  [0x1800, 0x19ff, "When a TPDO is sent, and with which CAN-ID. Bit 31 of the COB-ID switches the PDO off. Type 0 to 240 by SYNC, 254 by event timer, 255 with changes as well."],
  [0x1a00, 0x1bff, "The objects that a TPDO carries. Commissioning changes a mapping in the five steps that CiA 301 wants."],
];

const NODE = {
  0x2000: "What the node is: 0 pressure, 1 encoder, 2 both, 3 lift. In force after the next reset.",
  0x2001: "Events that were lost and healed, since power-on.",
  0x2200: "Calibration of the transducer. Locked: 2203h opens it.",
  0x2201: "Which thermometer is used, and its calibration.",
  0x2203: "Opens the calibration for writes.",
};

const PRESSURE = {
  0x6110: "Kind of the sensor at the input.",
  0x6124: "Added to the value, in its unit. Auto-zero sets it.",
  0x6125: "Makes the present value zero: the signature \"zero\" is wanted. Commissioning has a button for it.",
  0x6126: "The value is multiplied with this before its unit is applied.",
  0x6127: "Added after the factor.",
  0x6130: "The measured value in the unit of 6131h.",
  0x6131: "Unit of the value, by CiA 303-2: prefix in the highest byte, then the unit.",
  0x6132: "Where integer values have their decimal point.",
  0x6148: "Below this the status says negative overload.",
  0x6149: "Above this the status says positive overload.",
  0x6150: "0 valid, bit 0 not valid, bit 1 positive overload, bit 2 negative overload.",
  0x61a0: "Kind of the filter.",
  0x61a1: "How strong the filter is.",
  0x7130: "The measured value as INTEGER16, with the decimal digits of 6132h.",
  0x9130: "The measured value as INTEGER32, with the decimal digits of 6132h.",
};

const ENCODER = {
  0x6000: "Direction of counting, scaling and the like, a bit each.",
  0x6001: "Into how many units one revolution is divided.",
  0x6002: "After so many units the position begins at zero again.",
  0x6003: "The position becomes this value at once, and keeps it.",
  0x6004: "The position.",
  0x6030: "The speed.",
  0x6200: "Time between two TPDO 1, the same value as 1800h:5.",
  0x6300: "Which cams are on, a bit each.",
  0x6301: "Which cams are used, a bit each.",
  0x6302: "Which cams are inverted, a bit each.",
  0x6400: "Whether the position is within the work area.",
  0x6500: "Which functions are in force.",
  0x6503: "What makes the position useless, a bit each.",
  0x6505: "What should be looked at, a bit each.",
  0x6508: "Hours of operation.",
};

const LIFT = {
  0x2305: "Which units of the lift this node is: bit 0 car position, 1 load, 2 input panel, 3 output panel.",
  0x2322: "Lamps: 0 off, 10h to 17h flashing, anything else lit.",
  0x6001: "The number of the lift.",
  0x6010: "The newest call, as it is sent.",
  0x6011: "The newest message for the lamps.",
  0x6383: "Where the car is.",
};

/** In a module of two devices the transmitter is the second one, 800h higher. */
const SECOND_DEVICE = 0x800;

/** A sentence about an object; empty where there is none. */
export function help({ index, help: told }, personality) {
  if (told) return told;
  const pdo = PDO.find(([first, last]) => index >= first && index <= last);
  return COMMUNICATION[index] ?? pdo?.[2] ?? NODE_HELP[personality]?.(index) ?? "";
}

const NODE_HELP = {
  pressure: (index) => NODE[index] ?? PRESSURE[index],
  encoder: (index) => NODE[index] ?? cam(index) ?? ENCODER[index],
  combined: (index) => NODE[index] ?? cam(index) ?? ENCODER[index] ?? PRESSURE[index - SECOND_DEVICE],
  lift: (index) => NODE[index] ?? LIFT[index],
};

function cam(index) {
  if (index >= 0x6310 && index < 0x6318) return "Where the cam goes on.";
  if (index >= 0x6320 && index < 0x6328) return "Where the cam goes off.";
  return index >= 0x6330 && index < 0x6338 ? "How far the position has to go back before the cam changes." : null;
}
