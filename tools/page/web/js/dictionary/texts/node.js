// The objects that every node of this project has.

export const NODE = {
  0x2000: "What the node is: 0 pressure, 1 encoder, 2 both, 3 lift. In force after the next reset.",
  0x2001: "Events that were lost and healed, since power-on.",
  0x2002: "The trial of a new program: whether it may still be taken back, the command that ends it, and its times in s (0: none).",
  0x2003: "Who may change the program: whether the node asks for it (0: it does not, 1: closed, 2: open until the next start), the challenge of this start, and where the response goes.",
  0x2004: "The board, as a code: an update must be for this board.",
  0x2010: "Room and wear of the memory for parameters: saves that still fit, page erases so far, and page erases that are allowed now.",
  0x2100: "What measures the position: kind of shaft or rod, and how it is read.",
  0x2101: "Steps of the sensor: per revolution of an incremental shaft, nm a step for a rod. An absolute shaft has them in 2103h.",
  0x2102: "How many revolutions or periods the node counts itself.",
  0x2103: "The word of an SSI sensor: bits of revolutions and of steps, coding, alarm bits, parity.",
  0x2104: "Steps a millisecond that the machine can do at most. A reading further away is not believed. 0: no limit.",
  0x2105: "1: the index of the sensor is used.",
  0x2106: "Limits of supply, current, battery and operating time; beyond them is a warning.",
  0x2200: "Calibration of the transducer. Locked: 2203h opens it.",
  0x2201: "Which thermometer is used, and its calibration.",
  0x2202: "How often the device was calibrated, and when last (20251231 is a date).",
  0x2203: "Opens the calibration for writes.",
  0x2204: "Saves the calibration: the signature \"save\" (65766173h) is wanted.",
  0x2f00: "4 KiB of memory in which a transfer can be tried out: it reads as it was written.",
};
