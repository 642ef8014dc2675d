"""Motion, temperature and noise that an inertial sensor measures, and its settings for them.

`rates_dps`, `acceleration_g` ([x, y, z]), `temperature_c`, `tones` ([[axis, hz, dps], ...]), `motion` ([[time_us, rates, acceleration],
...], interpolated), `noise` (a factor, 0 for none),
`stopped` (True: the part answers and measures nothing until its next reset).
"""

from bisect import bisect_right
from math import pi, sin
from random import Random

PS, US = 1_000_000_000_000, 1_000_000
NAMES = {"noise": "noise", "rates_dps": "rates", "acceleration_g": "acceleration", "temperature_c": "temperature",
         "tones": "tones", "motion": "table", "stopped": "stopped"}


class Motion:
    """What happens to the sensor."""

    def __init__(self, seed):
        self.rates, self.acceleration, self.temperature = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 25.0
        self.tones, self.table = [], []
        self.noise, self.random, self.stopped = 1.0, Random(seed), False

    def configure(self, key, value):
        """Takes a setting."""
        if key not in NAMES:
            raise KeyError(f"the sensor has no setting {key}")
        setattr(self, NAMES[key], list(value) if isinstance(value, (list, tuple)) else value)

    def truth(self, at):
        """Returns rates in degrees per second and acceleration in g at a board time."""
        if self.table:
            return _interpolated(self.table, at / US)
        return list(self.rates), list(self.acceleration)

    def swing(self, rates, at, gain):
        """Adds the tones, each with the gain of the sensor's filter at its frequency."""
        for axis, hz, dps in self.tones:
            rates[axis] += dps * gain(hz) * sin(2 * pi * hz * at / PS)

    def noisy(self, values, density, bandwidth_hz):
        """Returns the values with white noise of this density within a bandwidth."""
        if not self.noise:
            return values
        sigma = self.noise * density * bandwidth_hz ** 0.5
        return [value + self.random.gauss(0, sigma) for value in values]


def clamp(value, bits):
    """Rounds a value to counts that are symmetric around zero, and clips it."""
    limit = 1 << bits - 1
    return max(1 - limit, min(limit - 1, round(value)))


def words(values, order):
    """Returns signed 16-bit words."""
    return b"".join(value.to_bytes(2, order, signed=True) for value in values)


def _interpolated(table, time_us):
    """Returns the motion interpolated between the two rows around a time; constant before the first and after the last row."""
    index = bisect_right(table, time_us, key=lambda row: row[0])
    if index in (0, len(table)):
        row = table[min(index, len(table) - 1)]
        return list(row[1]), list(row[2])
    (t0, r0, a0), (t1, r1, a1) = table[index - 1], table[index]
    part = (time_us - t0) / (t1 - t0)
    return [a + part * (b - a) for a, b in zip(r0, r1)], [a + part * (b - a) for a, b in zip(a0, a1)]
