"""Offset between two clocks by the correlation of a yaw rate in each, whatever their scale and bias."""

import numpy as np

STEP = 0.01  # s
COMMON_S, COMMON_SHARE = 20.0, 0.5  # least overlap, and as a share of the shorter rate
LEAST = 0.8  # correlation of a match
RIVAL_S, RIVAL = 3.0, 0.05  # a second peak further away than this must be lower by that
LONGEST = 8_192.0  # s of each rate that are compared


def offset(one, two):
    """Time to add to the second clock, s, the correlation there and the scale of the second rate; or the reason why not."""
    (begin, first), (start, second) = (on_grid(rate[rate[:, 0] - rate[0, 0] < LONGEST] if len(rate) else rate) for rate in (one, two))
    shorter = min(len(first), len(second))
    if shorter < 2:
        return None, "the yaw rates are too short"
    lags = np.arange(1 - len(second), len(first))
    # The part of each rate that overlaps at a lag, counted in the first.
    low, high = np.maximum(lags, 0), np.minimum(len(first), len(second) + lags)
    count = high - low

    def sums(values, lag):
        total = np.concatenate([[0.0], np.cumsum(values)])
        return total[high - lag] - total[low - lag]

    first, second = first - first.mean(), second - second.mean()
    size = 1 << (len(first) + len(second)).bit_length()
    products = np.fft.irfft(np.fft.rfft(first, size) * np.conj(np.fft.rfft(second, size)), size)[lags]
    means = sums(first, 0) / count, sums(second, lags) / count
    products -= count * means[0] * means[1]
    squares = [sums(rate**2, lag) - count * mean**2 for rate, lag, mean in zip((first, second), (0, lags), means)]
    norm = np.sqrt(np.maximum(squares[0] * squares[1], 0.0))
    known = (count >= max(COMMON_S / STEP, COMMON_SHARE * shorter)) & (norm > 1e-9)
    if not known.any():
        return None, "the yaw rates overlap too little in time, or do not turn"
    correlations = np.where(known, products / np.maximum(norm, 1e-9), -1.0)
    at = int(np.argmax(correlations))
    peak = correlations[at]
    if peak < LEAST:
        return None, f"the yaw rates do not match: correlation {peak:.2f}, at least {LEAST} is needed"
    rival = correlations[np.abs(lags - lags[at]) * STEP > RIVAL_S].max(initial=0.0)
    if rival > peak - RIVAL:
        return None, f"two offsets match equally well: correlations {peak:.3f} and {rival:.3f}"
    part = 0.0
    if 0 < at < len(lags) - 1 and known[at - 1] and known[at + 1]:
        left, right = correlations[[at - 1, at + 1]]
        part = 0.5 * (right - left) / max(2 * peak - left - right, 1e-12)
    return (begin - start + STEP * (lags[at] + part), float(peak), float(products[at] / squares[0][at])), None


def on_grid(rate):
    """Start and values in equal steps: means, or interpolated where a step has fewer than two samples."""
    if len(rate) < 2:
        return 0.0, np.empty(0)
    times, values = rate[:, 0], rate[:, 1]
    grid = times[0] + STEP * np.arange(int((times[-1] - times[0]) / STEP))
    first, behind = np.searchsorted(times, grid - 0.5 * STEP), np.searchsorted(times, grid + 0.5 * STEP)
    sums = np.concatenate([[0.0], np.cumsum(values)])
    count = behind - first
    return times[0], np.where(count > 1, (sums[behind] - sums[first]) / np.maximum(count, 1), np.interp(grid, times, values))
