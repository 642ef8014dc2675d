"""gyronet in Python: the board (`Coprocessor`), import of logs (`gyronet.logs`), wheel settings of DBC files (`gyronet.wheels`)."""


def __getattr__(name):
    if name != "Coprocessor":
        raise AttributeError(f"module 'gyronet' has no attribute {name!r}")
    try:
        from gyronet._core import Coprocessor
    except ImportError:
        raise ImportError("the board is not in this installation: install Rust (https://rustup.rs), then the package again") from None
    return Coprocessor
