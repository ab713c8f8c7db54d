"""The error budget of docs/wiring.md: what the parts of each circuit add to the error, in per cent of full scale."""

from math import sqrt

#: Volts a step of the converter.
STEP = 3.3 / 4096
#: The largest errors of a conversion, in steps (data sheet of the STM32F405, 30 MHz, source below 10 kohm).
TOTAL, LINEARITY = 5, 3
#: Relative tolerance, and relative change over 40 K at 25 ppm/K.
TOLERANCE, DRIFT = 0.001, 25e-6 * 40
#: The same of a REF3025, and of the gain of an INA333.
REFERENCE, REFERENCE_DRIFT = 0.002, 50e-6 * 40
GAIN, GAIN_DRIFT = 0.005, 50e-6 * 40

#: A part adds an error as built, and another one after a calibration at two points.
Part = tuple[float, float]


def converter(top: float, span: float, reference: float) -> list[Part]:
    """Errors of the two conversions; `top` is the ratio at full scale. A calibration leaves the linearity of PA0."""
    steps = reference / STEP
    return [(TOTAL / steps / span, LINEARITY / steps / span), (TOTAL / steps * top / span, 0.0)]


def dividers(top: float, span: float) -> list[Part]:
    """The four resistors of two equal dividers of 10 and 15 kohm."""
    return [(0.4 * TOLERANCE * top / span, 0.4 * DRIFT * top / span)] * 4


def ratiometric() -> list[Part]:
    return converter(0.9, 0.8, 3.0) + dividers(0.9, 0.8)


def offset_ratio(volts: float, resistors: tuple[float, ...], reference: float = 2.5) -> float:
    """The ratio at PA0 for a sensor of 0 to 10 V: resistors to the sensor, to ground and to the reference."""
    sensor, ground, lift = resistors
    return (volts / sensor + reference / lift) / (1 / sensor + 1 / ground + 1 / lift) / reference


def voltage() -> list[Part]:
    values = (35.7e3, 10.2e3, 71.5e3)
    top = offset_ratio(10, values)
    span = top - offset_ratio(0, values)
    parts = converter(top, span, 2.5)
    for which in range(3):
        changed = tuple(value * (1 + TOLERANCE * (which == i)) for i, value in enumerate(values))
        error = abs(offset_ratio(10, changed) - top) / span
        parts.append((error, error * DRIFT / TOLERANCE))
    sensitivity = abs(offset_ratio(10, values, 2.5 * 1.001) - top) / span / 0.001
    return [*parts, (sensitivity * REFERENCE, sensitivity * REFERENCE_DRIFT)]


def current() -> list[Part]:
    scale = 0.8 / 0.64
    return [
        *converter(0.8, 0.64, 2.5),
        (TOLERANCE * scale, DRIFT * scale),
        (REFERENCE * scale, REFERENCE_DRIFT * scale),
    ]


def bridge() -> list[Part]:
    gain = 1 + 100e3 / 249
    span, full_scale = gain * 0.002, 0.01
    offset = ((25e-6 + 75e-6 / gain) / full_scale, (0.1e-6 + 0.5e-6 / gain) * 40 / full_scale)
    zero = (2 * 0.9 * 0.1 * TOLERANCE / span, 2 * 0.9 * 0.1 * DRIFT / span)
    amplifier = [(GAIN, GAIN_DRIFT), (TOLERANCE, DRIFT), offset, zero]
    return converter(0.1 + span, span, 3.0) + dividers(0.1 + span, span) + amplifier


CIRCUITS = {
    "ratiometric, resistors 0.1 %, 25 ppm/K": ratiometric,
    "0 to 10 V, REF3025": voltage,
    "4 to 20 mA, REF3025": current,
    "bridge 2 mV/V, INA333": bridge,
}


def table() -> str:
    rows = ["| circuit | as built, sum | root of squares | calibrated, sum | root of squares |", "|---|---|---|---|---|"]
    for name, parts in CIRCUITS.items():
        columns = list(zip(*parts()))
        figures = [f(column) for column in columns for f in (sum, lambda x: sqrt(sum(e * e for e in x)))]
        rows.append(f"| {name} | " + " | ".join(f"{100 * figure:.2f} %" for figure in figures) + " |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
