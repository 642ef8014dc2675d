"""Main memory of the STM32F405xG: 1 MiB in twelve sectors (RM0090 table 5)."""

BASE = 0x0800_0000
_KIB = 1024
_LENGTHS = [16 * _KIB] * 4 + [64 * _KIB] + [128 * _KIB] * 7
#: (address, length) of each sector.
SECTORS = tuple((BASE + sum(_LENGTHS[:number]), length) for number, length in enumerate(_LENGTHS))
SIZE = sum(_LENGTHS)


def sector_of(address):
    """Returns the number of the sector that holds an address."""
    for number, (start, length) in enumerate(SECTORS):
        if start <= address < start + length:
            return number
    raise ValueError(f"{address:#x} is outside of the main memory")
