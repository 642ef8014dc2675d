"""Resampling to the 100 Hz rows of a drive. Rows in a gap are NaN, because an invented row could not be told from a measured one."""

import numpy as np

DT = 0.01
AVERAGED_HZ = 150.0  # from here on a row is the mean of the samples within 5 ms
GAP_PERIODS = 2.5
RATED = 100_000  # periods, from the beginning, of which the median is taken


def rate(seconds):
    """The sample rate by the median period, Hz."""
    return float(1 / np.median(np.diff(seconds[: RATED + 1]))) if len(seconds) > 1 else 0.0


def resample(stamps, read, hz, times, offset=0.0):
    """Values at rising times, of samples with these stamps plus the offset; `read` gives the values of a range of samples."""
    low, high = np.searchsorted(stamps, [times[0] - offset - 2.0, times[-1] - offset + 2.0])
    # One sample beyond each end, so that interpolation has both neighbours.
    low, high = max(int(low) - 1, 0), min(int(high) + 1, len(stamps))
    stamps, values = stamps[low:high] + offset, read(low, high)
    if not len(stamps):
        return np.full((len(times), values.shape[1]), np.nan)
    return means(stamps, values, times) if hz >= AVERAGED_HZ else between(stamps, values, times, GAP_PERIODS / hz)


def means(stamps, values, times):
    first = np.searchsorted(stamps, times - 0.5 * DT)
    behind = np.searchsorted(stamps, times + 0.5 * DT)
    first[1:] = np.maximum(first[1:], behind[:-1])
    sums = np.add.reduceat(np.vstack([values, np.zeros(values.shape[1])]), np.column_stack([first, behind]).ravel())[::2]
    count = (behind - first)[:, None]
    return np.where(count > 0, sums / np.maximum(count, 1), np.nan)


def between(stamps, values, times, longest):
    before = np.maximum(np.searchsorted(stamps, times, side="right") - 1, 0)
    behind = np.minimum(before + 1, len(stamps) - 1)
    period = stamps[behind] - stamps[before]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (times - stamps[before]) / period
        known = (period <= longest) & (share >= 0) & (share <= 1) & (behind > before)
        mixed = values[before] + share[:, None] * (values[behind] - values[before])
    exact = np.abs(times - stamps[before]) < 1e-6
    return np.where(exact[:, None], values[before], np.where(known[:, None], mixed, np.nan))


def spread_bursts(seconds):
    """Even stamps for samples that a driver read several at a time, and a remark; (None, None) where they are even already.

    The samples of a burst are spread from the burst before it up to the burst's own last stamp.
    """
    periods = np.diff(seconds)
    if len(periods) < 20:
        return None, None
    mean = (seconds[-1] - seconds[0]) / len(periods)
    short, long = np.mean(periods < 0.2 * mean), periods > 1.2 * mean
    if short < 0.4 or np.mean(long) < 1 / 64:
        return None, None
    ends = np.append(np.flatnonzero(long), len(seconds) - 1)
    size, burst = np.diff(np.concatenate([[-1], ends])), np.median(np.diff(seconds[ends]))
    step = np.minimum(np.diff(seconds[ends], prepend=seconds[ends[0]] - burst), 2.5 * burst)
    step[0] = burst
    place = np.arange(len(seconds)) - np.repeat(ends - size, size)
    even = np.repeat(seconds[ends], size) - np.repeat(step, size) * (1 - place / np.repeat(size, size))
    begin = seconds[int(np.argmax(periods < 0.2 * mean))] - seconds[0]
    remark = f"stamps come in bursts of {int(np.median(size))} every {burst:.3f} s from {begin:.2f} s on and are spread evenly"
    return even, remark
