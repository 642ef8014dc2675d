"""The error that ends a run: the program did something that the model does not cover, or that no board allows."""


class Violation(Exception):
    """Holds what the program did, where, and why the model cannot continue.

    Peripherals raise it with only a text; the board adds the time, the program counter and the symbol.
    """

    def __init__(self, what: str, address: int | None = None):
        super().__init__(what)
        self.what = what
        self.address = address
        self.pc: int | None = None
        self.symbol: str | None = None
        self.now: int | None = None

    def __str__(self) -> str:
        parts = [self.what]
        if self.address is not None:
            parts.append(f"address 0x{self.address:08X}")
        if self.pc is not None:
            parts.append(f"pc 0x{self.pc:08X} in {self.symbol or 'no symbol'}")
        if self.now is not None:
            parts.append(f"at {self.now / 1e6:.3f} us")
        return ", ".join(parts)
