#!/usr/bin/env python3
"""Writes what golden values of CiA 404 there are besides those of cia404_chain.py, in exact decimal arithmetic:

cia404_response.csv  step and impulse response of each filter until it has settled
cia404_unit.csv      every unit with every prefix
cia404_digits.csv    every digit shift at the limits of INTEGER16 and INTEGER32
cia404_status.csv    the status at and beside the limits of each span

    python3 host-tests/golden/cia404_edges.py host-tests/golden
"""

import itertools
import struct
import sys
from decimal import ROUND_HALF_EVEN, Decimal
from pathlib import Path

from cia404_chain import HALF_ULP, KELVIN, PASCAL, filtered, single, truncate, write

STEP = Decimal(100_000)
INVALID, ABOVE, BELOW = 1, 2, 4
SPAN16, SPAN32 = (-(2**15), 2**15 - 1), (-(2**31), 2**31 - 1)


def response_rows():
    """Responses to 1 bar from sample 1 on (step) or at sample 1 only (impulse)."""
    for kind, constant in itertools.product((1, 2), (1, 2, 10, 100, 255)):
        length = settled_after(constant) if kind == 1 else 3 * constant + 2
        for stimulus in ("step", "impulse"):
            inputs = [Decimal(0), STEP] + [STEP if stimulus == "step" else Decimal(0)] * length
            outputs = filtered(kind, constant, inputs)
            for sample in sorted(chosen(len(outputs), constant)):
                yield [kind, constant, stimulus, sample, format(outputs[sample], ".15g")]


def settled_after(constant):
    """Number of samples until the output is within half a unit in the last place of a REAL32."""
    rest = 1 - Decimal(1) / constant
    return 1 if rest == 0 else int(26 * Decimal(2).ln() / -rest.ln()) + 2


def chosen(length, constant):
    """The first samples, then fewer and fewer, the samples around the ends of the first blocks, and the last one."""
    samples, at = set(range(12)) | {length - 1}, 12.0
    while at < length:
        samples.add(int(at))
        at *= 1.2
    samples.update(block * constant + beside for block in (1, 2, 3) for beside in (-2, -1, 0))
    return {sample for sample in samples if 0 <= sample < length}


def unit_rows():
    for prefix in range(-18, 19):
        power = Decimal(10) ** prefix
        for unit, field in itertools.product(PASCAL, ("-1234.5", "101325", "1000000")):
            value = single(field) / PASCAL[unit] / power
            # Rounded twice: the divisor and the quotient.
            yield unit_row("pressure", unit, prefix, field, value, 2 * abs(value))
        for unit, field in itertools.product(KELVIN, ("0", "233.15", "255.3722", "273.15", "310.15", "398.15")):
            value, zero = (KELVIN[unit](single(kelvin)) / power for kelvin in (field, 0))
            # Rounded four times: the divisor, the quotient, the zero and the difference.
            yield unit_row("temperature", unit, prefix, field, value, 2 * abs(value - zero) + abs(zero) + abs(value))


def unit_row(channel, unit, prefix, field, value, rounded):
    code = (prefix & 0xFF) << 24 | unit << 16
    tolerance = rounded * HALF_ULP * Decimal("1.01")
    return [channel, f"0x{code:08X}", field, format(value, ".12g"), format(tolerance, ".3g")]


def digit_rows():
    for digits, (low, high) in itertools.product(range(39), (SPAN16, SPAN32)):
        for limit, beside in itertools.product((low - 1, low, high, high + 1), range(-2, 3)):
            value = neighbour(Decimal(limit) / Decimal(10) ** digits, beside)
            product = rounded(value * rounded(Decimal(10) ** digits))
            is_clipped = int(product) != truncate(product, 16)
            yield [digits, format(value, ".9g"), truncate(product, 16), truncate(product, 32), int(is_clipped)]


def rounded(value):
    """The nearest REAL32, ties to even, rounded once."""
    if value == 0:
        return value
    exponent = value.copy_abs().log10() / Decimal(2).log10()
    place = Decimal(2) ** (int(exponent.to_integral_value(rounding="ROUND_FLOOR")) - 23)
    return (value / place).to_integral_value(rounding=ROUND_HALF_EVEN) * place


def neighbour(value, beside):
    """The REAL32 that is `beside` places away from the nearest one."""
    bits = struct.unpack("<i", struct.pack("<f", float(value)))[0]
    return Decimal(struct.unpack("<f", struct.pack("<i", bits + beside))[0])


def status_rows():
    yield from real_rows()
    wide = [SPAN16, (-5, 5), (100, -100), (0, 0), (32766, 32767)]
    yield from integer_rows(16, wide)
    yield from integer_rows(32, [*wide, SPAN32, (-100_000, 100_000), (2**30, -(2**30))])


def real_rows():
    for span in ((0, 10), (-40, 125), (10, 0), (5, 5), ("-0.1", "0.1")):
        start, end = (single(limit) for limit in span)
        for limit, beside in itertools.product((start, end), (-1, 0, 1)):
            # The neighbours of 0 are the smallest numbers of either sign.
            tiny = beside * Decimal(2) ** -149 if beside else Decimal(0)
            value = tiny if limit == 0 else neighbour(limit, beside)
            yield status_row("REAL32", start, end, value, overload(value, start, end))


def integer_rows(bits, spans):
    for start, end in spans:
        for limit, beside in itertools.product((start, end), ("-1", "-0.75", "0", "0.75", "1")):
            value = single(limit + Decimal(beside))
            clipped = INVALID if int(value) != truncate(value, 16) else 0
            status = clipped | overload(truncate(value, bits), start, end)
            yield status_row(f"INTEGER{bits}", start, end, value, status)


def overload(value, start, end):
    return (ABOVE if value > end else 0) | (BELOW if value < start else 0)


def status_row(kind, start, end, value, status):
    return [kind, format(start, ".9g") if kind == "REAL32" else start, format(end, ".9g") if kind == "REAL32" else end,
            format(value, ".9g"), status]


def main():
    folder = Path(sys.argv[1])
    write(folder / "cia404_response.csv", ["type", "constant", "stimulus", "sample", "output"], response_rows())
    write(folder / "cia404_unit.csv", ["channel", "unit", "field_value", "process_value", "tolerance"], unit_rows())
    write(folder / "cia404_digits.csv", ["digits", "value", "int16", "int32", "status"], digit_rows())
    write(folder / "cia404_status.csv", ["format", "start", "end", "value", "status"], status_rows())


if __name__ == "__main__":
    main()
