"""gyronet in Python: the board (`Coprocessor`), import of logs (`gyronet.logs`), corrected bags
(`gyronet.correct`), wheel settings of DBC files (`gyronet.wheels`)."""

from pkgutil import extend_path

# The sources, run as they are, find the extension of an installed package.
__path__ = extend_path(__path__, __name__)


def __getattr__(name):
    if name != "Coprocessor":
        raise AttributeError(f"module 'gyronet' has no attribute {name!r}")
    try:
        from gyronet._core import Coprocessor
    except ImportError:
        raise ImportError("this Python has gyronet without the board: install Rust (https://rustup.rs), then pip install ./tools/python again") from None
    return Coprocessor
