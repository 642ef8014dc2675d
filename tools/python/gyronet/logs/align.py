"""Offset between two clocks by the correlation of a yaw rate in each, whatever their scale and bias."""

import numpy as np

COARSE, FINE = 0.5, 0.01  # steps, s
COMMON_S, COMMON_SHARE = 20.0, 0.5  # least overlap, and as a share of the shorter rate
LEAST = 0.8  # correlation of a match
RIVAL_S, RIVAL = 3.0, 0.05  # a second peak further away than this must be lower by that
LONGEST = 8_192.0  # s of each rate that are compared


def offset(one, two):
    """Time to add to the second clock, s, the correlation there and the scale of the second rate; or the reason why not."""
    one, two = (rate[rate[:, 0] - rate[0, 0] < LONGEST] if len(rate) else rate for rate in (one, two))
    grids = on_grid(one, COARSE), on_grid(two, COARSE)
    if not all(len(values) for _, values in grids):
        return None, "the yaw rates are too short"
    (start_one, first), (start_two, second) = grids
    least = int(max(COMMON_S, COMMON_SHARE * COARSE * min(len(first), len(second))) / COARSE)
    lags = {lag: correlation(first, second, lag, least) for lag in range(-len(second), len(first))}
    lags = {lag: value for lag, value in lags.items() if value is not None}
    if not lags:
        return None, "the yaw rates overlap too little in time"
    lag = max(lags, key=lambda k: (lags[k], k))
    rival = max([value for k, value in lags.items() if abs(k - lag) * COARSE > RIVAL_S] + [0.0])
    seconds, best, scale = fine(one, two, start_one - start_two + COARSE * lag)
    if best < LEAST:
        return None, f"the yaw rates do not match: correlation {best:.2f}, at least {LEAST} is needed"
    if rival > lags[lag] - RIVAL:
        return None, f"two offsets match equally well: correlations {lags[lag]:.3f} and {rival:.3f}"
    return (seconds, best, scale), None


def fine(one, two, near):
    (start_one, first), (start_two, second) = on_grid(one, FINE), on_grid(two, FINE)
    middle, reach, least = round((near + start_two - start_one) / FINE), int(1.5 * COARSE / FINE), int(COMMON_S / FINE / 2)
    values = {lag: correlation(first, second, lag, least) for lag in range(middle - reach - 1, middle + reach + 2)}
    known = {lag: value for lag, value in values.items() if value is not None and abs(lag - middle) <= reach}
    if not known:
        return near, 0.0, 1.0
    lag = max(known, key=lambda k: (known[k], k))
    left, right, peak = values.get(lag - 1), values.get(lag + 1), known[lag]
    part = 0.0
    if left is not None and right is not None and left + right < 2 * peak:
        part = 0.5 * (right - left) / (2 * peak - left - right)
    a, b = overlap(first, second, lag)
    a, b = a - a.mean(), b - b.mean()
    return start_one - start_two + FINE * (lag + part), peak, float(np.dot(a, b) / np.dot(a, a))


def on_grid(rate, step):
    """Start and values in equal steps: means, or interpolated where a step has fewer than two samples."""
    if len(rate) < 2:
        return 0.0, np.empty(0)
    times, values = rate[:, 0], rate[:, 1]
    grid = times[0] + step * np.arange(int((times[-1] - times[0]) / step))
    first, behind = np.searchsorted(times, grid - 0.5 * step), np.searchsorted(times, grid + 0.5 * step)
    sums = np.concatenate([[0.0], np.cumsum(values)])
    count = behind - first
    return times[0], np.where(count > 1, (sums[behind] - sums[first]) / np.maximum(count, 1), np.interp(grid, times, values))


def overlap(one, two, lag):
    one, two = one[max(lag, 0):], two[max(-lag, 0):]
    length = min(len(one), len(two))
    return one[:length], two[:length]


def correlation(one, two, lag, least):
    one, two = overlap(one, two, lag)
    if len(one) < max(least, 2):
        return None
    one, two = one - one.mean(), two - two.mean()
    norm = np.sqrt(np.dot(one, one) * np.dot(two, two))
    return float(np.dot(one, two) / norm) if norm > 1e-12 else None
