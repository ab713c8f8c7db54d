#!/usr/bin/env python3
"""Writes cia404_chain.csv and cia404_filter.csv: process values of the CiA 404 chain in exact decimal arithmetic.

Independent of the Rust code: units are defined here again, from their definitions. Inputs are REAL32 values, exactly as
the node sees them. The result is exact; the node computes in single precision, so each row states the error that five
correctly rounded single-precision operations can make. Rows whose integer would depend on that error are left out.

    python3 host-tests/golden/cia404_chain.py host-tests/golden
"""

import csv
import itertools
import random
import struct
import sys
from decimal import Decimal, getcontext
from pathlib import Path

getcontext().prec = 60
HALF_ULP = Decimal(2) ** -24
G = Decimal("9.80665")
PASCAL = {
    0x22: Decimal(1),
    0x4E: Decimal(100_000),
    0xAB: Decimal("0.45359237") * G / (Decimal("0.0254") ** 2),
    0xA0: Decimal("13595.1") * G / 1000,
    0xA1: 10_000 * G,
    0xA2: Decimal("999.972") * G / 1000,
    0xA4: Decimal(101_325),
}
KELVIN = {
    0x05: lambda kelvin: kelvin,
    0x2D: lambda kelvin: kelvin - Decimal("273.15"),
    0xAC: lambda kelvin: kelvin * 9 / 5 - Decimal("459.67"),
}


def single(value):
    """The nearest REAL32, exactly."""
    return Decimal(struct.unpack("<f", struct.pack("<f", float(value)))[0])


def truncate(value, bits):
    """Toward zero, saturated."""
    return max(-(2 ** (bits - 1)), min(2 ** (bits - 1) - 1, int(value)))


def row(channel, unit, prefix, field, factor, scaling_offset, offset, digits):
    scaled = field * factor + scaling_offset
    converted = scaled / PASCAL[unit] if channel == "pressure" else KELVIN[unit](scaled)
    divided = converted / Decimal(10) ** prefix
    value = divided + offset
    # The largest intermediate value bounds the error of each operation.
    ratio = abs(divided / converted) if converted else Decimal(0)
    scale = Decimal(1) / PASCAL[unit] if channel == "pressure" else Decimal(2)
    zero = Decimal(0) if channel == "pressure" else Decimal("459.67")
    largest = max(abs(field * factor), abs(scaling_offset), abs(scaled)) * scale * (ratio or 1)
    largest = max(largest, zero * ratio, abs(offset), abs(value))
    tolerance = 5 * largest * HALF_ULP
    shifted, error = value * Decimal(10) ** digits, 2 * tolerance * Decimal(10) ** digits
    for bits in (16, 32):
        if truncate(shifted - error, bits) != truncate(shifted + error, bits):
            return None
    clipped = int(shifted) != truncate(shifted, 16)
    code = (prefix & 0xFF) << 24 | unit << 16
    numbers = [format(n, ".12g") for n in (field, factor, scaling_offset, offset)]
    assert all(single(Decimal(n)) == exact for n, exact in zip(numbers, (field, factor, scaling_offset, offset)))
    return [channel, f"0x{code:08X}", *numbers, digits, format(value, ".12g"), format(tolerance, ".3g"),
            truncate(shifted, 16), truncate(shifted, 32), int(clipped)]


def cases():
    """A grid of ordinary cases, and random other cases with a fixed seed."""
    for unit, prefix in itertools.product(PASCAL, (0, -3, 3, -18, 18)):
        for field in (0, 1, 101325, 250000.5, 1000000, -1234.5):
            yield "pressure", unit, prefix, field, 1, 0, 0, 2
    for unit, prefix in itertools.product(KELVIN, (0, -3, 2)):
        for field in (0, 233.15, 273.15, 298.25, 398.15):
            yield "temperature", unit, prefix, field, 1, 0, 0, 1
    choose = random.Random(404)
    for _ in range(400):
        pressure = choose.random() < 0.5
        field = choose.uniform(-20_000, 1_100_000) if pressure else choose.uniform(200, 420)
        yield ("pressure" if pressure else "temperature", choose.choice(list(PASCAL if pressure else KELVIN)),
               choose.randint(-6, 6), field, choose.uniform(-3, 3), choose.uniform(-1000, 1000),
               choose.choice([0, choose.uniform(-50, 50)]), choose.randint(0, 6))


def rows():
    for channel, unit, prefix, field, factor, scaling_offset, offset, digits in cases():
        numbers = (single(n) for n in (field, factor, scaling_offset, offset))
        result = row(channel, unit, prefix, *numbers, digits)
        if result:
            yield result


def filtered(kind, constant, inputs):
    """The outputs of a filter by its definition (61A0h)."""
    outputs, block, last = [], [], None
    for value in inputs:
        block.append(value)
        if kind == 1:
            last = value if last is None else last + (value - last) / constant
        elif kind == 2:
            last = value if last is None else last
            if len(block) == constant:
                last, block = sum(block) / constant, []
        else:
            last = value
        outputs.append(last)
    return outputs


def filter_rows():
    choose = random.Random(61)
    for kind, constant in [(0, 7), (1, 1), (1, 2), (1, 10), (1, 255), (2, 1), (2, 2), (2, 7), (2, 30), (3, 9), (255, 4)]:
        inputs = [single(choose.uniform(-10, 1_000_000)) for _ in range(40)]
        outputs = filtered(kind, constant, inputs)
        yield [kind, constant, " ".join(format(i, ".12g") for i in inputs), " ".join(format(o, ".12g") for o in outputs)]


def write(path, header, content):
    with open(path, "w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(content)


def main():
    folder = Path(sys.argv[1])
    write(folder / "cia404_chain.csv",
          ["channel", "unit", "field_value", "factor", "scaling_offset", "offset", "digits", "process_value",
           "tolerance", "int16", "int32", "clipped"], rows())
    write(folder / "cia404_filter.csv", ["type", "constant", "inputs", "outputs"], filter_rows())


if __name__ == "__main__":
    main()
