"""Course over ground of GNSS fixes and its uncertainty, for `ref_yaw`: by Doppler where the receiver gives it, else by chords.

A chord joins a fix before with a fix behind, far enough apart that it is long beside the scatter of neighbouring fixes,
which third differences show: the motion of the vehicle hardly contributes to them.
"""

import math

import numpy as np

SLOWEST, WORST, LONGEST, LEAST_SCATTER, METRES = 1.0, 0.15, 4.0, 0.01, 111_320.0


def courses(rows):
    """Rows of time, course (rad to the left, unwrapped), its standard deviation and speed."""
    found = by_velocity(rows) if np.isfinite(rows[:, 3]).any() else by_positions(rows) if len(rows) > 3 else []
    found = np.array(found, float).reshape(-1, 4)
    found[:, 1] = np.unwrap(found[:, 1])
    return found


def by_velocity(rows):
    seconds, _, _, speed, clockwise, sigma = rows.T
    good = (speed >= SLOWEST) & (sigma > 0) & (sigma < WORST) & np.isfinite(clockwise)
    return np.column_stack([seconds, -clockwise, sigma, speed])[good]


def by_positions(rows):
    east = METRES * math.cos(math.radians(rows[0, 1]))
    x, y, times = east * (rows[:, 2] - rows[0, 2]), METRES * (rows[:, 1] - rows[0, 1]), rows[:, 0]
    noise, found = scatter(x, y), []
    for k in range(1, len(rows) - 1):
        for reach in range(1, min(k, len(rows) - 1 - k) + 1):
            begin, end = k - reach, k + reach
            seconds = times[end] - times[begin]
            if seconds > LONGEST:
                break
            dx, dy = x[end] - x[begin], y[end] - y[begin]
            length = math.hypot(dx, dy)
            # The shortest chord that is good enough, since a longer one cuts a bend.
            if length / seconds >= SLOWEST and math.sqrt(2) * noise / length < 0.5 * WORST:
                found.append((times[k], math.atan2(dy, dx), math.sqrt(2) * noise / length, length / seconds))
                break
    return found


def scatter(x, y):
    """Standard deviation of neighbouring fixes in one direction, m, by the median third difference."""
    sizes = np.sort(np.abs(np.concatenate([np.diff(x, 3), np.diff(y, 3)])))
    # 1 + 9 + 9 + 1 variances; a median of absolute values is 0.6745 standard deviations.
    return max(sizes[len(sizes) // 2] / (0.6745 * math.sqrt(20)), LEAST_SCATTER)
