"""Progress of a long run on standard error, on a terminal only."""

from tqdm import tqdm

QUIET = False


def bar(items, name, total=None):
    return tqdm(items, name, total, leave=False, disable=QUIET or None)
