#!/usr/bin/env python3
"""Writes cia406_position.csv and cia406_speed.csv: what an encoder of CiA 406 shows, in exact integer and decimal arithmetic.

Independent of the Rust code: the position is the quotient of the profile's formula on integers without bounds, frames of
absolute encoders are coded here from their definition.

    python3 host-tests/golden/cia406_chain.py host-tests/golden
"""

import csv
import random
import sys
from decimal import Decimal, ROUND_HALF_UP, getcontext
from fractions import Fraction
from pathlib import Path

getcontext().prec = 60
SINGLE, MULTI, SINGLE_COUNTED, INCREMENTAL, COUNTED, ROD, ROD_COUNTED, ROD_ABSOLUTE, ROD_CYCLIC = range(1, 10)
ABSOLUTE = (SINGLE, MULTI, SINGLE_COUNTED, ROD_ABSOLUTE, ROD_CYCLIC)
LINEAR = (ROD, ROD_COUNTED, ROD_ABSOLUTE, ROD_CYCLIC)


def steps(case):
    """Native steps per revolution or of a rod, and the number of positions that the sensor distinguishes."""
    bits = 2 ** (case["revolution_bits"] + case["step_bits"])
    return {
        SINGLE: 2 ** case["step_bits"],
        MULTI: bits,
        SINGLE_COUNTED: 2 ** case["step_bits"] * case["counted"],
        INCREMENTAL: case["resolution"],
        COUNTED: case["resolution"] * case["counted"],
        ROD: 2 ** 32,
        ROD_COUNTED: 2 ** 32,
        ROD_ABSOLUTE: bits,
        ROD_CYCLIC: bits * case["counted"],
    }[case["type"]]


def per_revolution(case):
    return 2 ** case["step_bits"] if case["type"] in ABSOLUTE else case["resolution"]


def units_per_step(case):
    if not case["scaling"]:
        return Fraction(1)
    if case["type"] in LINEAR:
        return Fraction(case["resolution"], case["step"])
    return Fraction(case["per_revolution"], per_revolution(case))


def word_bits(case):
    if case["type"] not in ABSOLUTE:
        return 16
    turns = 0 if case["type"] in (SINGLE, SINGLE_COUNTED) else case["revolution_bits"]
    return turns + case["step_bits"]


def frame(case, total):
    """The input: a timer count, or the bits of an SSI frame with the rest level before and two bits after the word."""
    position = total % 2 ** word_bits(case)
    if case["type"] not in ABSOLUTE:
        return format(position, "x")
    code = position ^ position >> 1 if case["gray"] else position
    bits = format(code, f"0{case['revolution_bits'] + case['step_bits']}b")
    bits += "0" if case["alarm"] else ""
    if case["parity"]:
        bits += str((bits.count("1") + (case["parity"] == 2)) % 2)
    return format(int("1" + bits + "00", 2), "x")


def positions(case, totals):
    """The positions without offset."""
    distinct = case["range"] if case["scaling"] else min(steps(case), 2 ** 32)
    for total in totals:
        counted = -1 - total if case["reversed"] else total
        yield int(counted * units_per_step(case) // 1) % distinct, distinct


def rows():
    choose = random.Random(406)
    for number in range(300):
        kind = number % 9 + 1
        case = {
            "type": kind,
            "resolution": choose.choice([4, 360, 4096, 20_000, 1_000_000, 2 ** 32 - 1]),
            "counted": choose.choice([1, 3, 4096, 65_535]),
            # A single-turn encoder sends no revolutions.
            "revolution_bits": 0 if kind in (SINGLE, SINGLE_COUNTED) else choose.randint(0, 16),
            "step_bits": choose.randint(2, 16),
            "gray": choose.randint(0, 1),
            "alarm": choose.randint(0, 1),
            "parity": choose.randint(0, 2),
            "scaling": choose.randint(0, 3) > 0,
            "reversed": choose.randint(0, 1),
        }
        native = 2 ** 32 - 1 if kind in LINEAR else per_revolution(case)
        case["per_revolution"] = choose.choice([1, native, choose.randint(1, native)])
        case["range"] = choose.randint(1, min(steps(case), 2 ** 32 - 1))
        if choose.randint(0, 1):
            case["range"] = min(case["per_revolution"] * 16, steps(case), 2 ** 32 - 1)
        case["step"] = choose.choice([case["resolution"], choose.randint(case["resolution"], 2 ** 32 - 1)])
        most = 2 ** (word_bits(case) - 1) - 1
        totals = [0 if kind not in ABSOLUTE else choose.randrange(2 ** word_bits(case))]
        for _ in range(40):
            totals.append(totals[-1] + choose.choice([-most, most, choose.randint(-most, most), 1, -1]))
        values = list(positions(case, totals))
        distinct = values[0][1]
        preset = choose.randrange(min(distinct, 2 ** 32))
        at = choose.randrange(len(totals))
        moved = (preset - values[at][0]) % distinct
        offset = moved - distinct if 2 * moved >= distinct else moved
        shown = [value if place < at else (value + offset) % distinct for place, (value, _) in enumerate(values)]
        yield [*(int(value) for value in case.values()), preset, at, offset,
               " ".join(frame(case, total) for total in totals), " ".join(map(str, shown))]


def speed_rows():
    """Revolutions per minute or um/s of a sensor, and 6030h: exact, rounded half away from zero, saturated."""
    for kind, resolution, units, speed_step in [
        (COUNTED, 4096, 4096, 1), (COUNTED, 4096, 360, 1), (COUNTED, 20_000, 100, 1), (ROD, 1000, 0, 1),
        (ROD, 5000, 0, 100), (ROD, 250, 0, 7),
    ]:
        for size in ["0", "0.5", "3", "17.3", "60", "123.456", "1000", "6000", "11000"]:
            for sign in (1, -1):
                speed = Decimal(size) * sign
                if kind == COUNTED:
                    per_second, value = speed * resolution / 60, speed * units / 60
                else:
                    # 60 um/s a step of the list, in nm; 6005h:2 is in 0.01 mm/s.
                    nanometres = speed * 60_000
                    per_second, value = nanometres / resolution, nanometres / 10_000 / speed_step
                # Slower than one step in 1.024 s is standstill.
                if abs(per_second) < Decimal(1000) / 1024:
                    value = Decimal(0)
                rounded = int(value.quantize(Decimal(1), ROUND_HALF_UP))
                saturated = max(-(2 ** 15), min(2 ** 15 - 1, rounded))
                yield [kind, resolution, units, speed_step, format(per_second.normalize(), "f"), saturated]


def write(path, header, content):
    with open(path, "w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(content)


def main():
    folder = Path(sys.argv[1])
    write(folder / "cia406_position.csv",
          ["type", "resolution", "counted", "revolution_bits", "step_bits", "gray", "alarm", "parity", "scaling", "reversed",
           "per_revolution", "range", "step", "preset", "preset_at", "offset", "frames", "positions"], rows())
    write(folder / "cia406_speed.csv",
          ["type", "resolution", "per_revolution", "speed_step", "steps_per_second", "speed"], speed_rows())


if __name__ == "__main__":
    main()
