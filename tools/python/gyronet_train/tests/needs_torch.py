"""PyTorch for the tests that want it: a module that imports this is skipped where it is not installed."""

import unittest

try:
    import torch
except ImportError as error:
    raise unittest.SkipTest("wants torch") from error

__all__ = ["torch"]
