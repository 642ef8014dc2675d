"""Reads the parts of an ELF file that the board needs: the loadable segments and the symbols (32-bit, little-endian, ARM)."""

import bisect
import struct

PT_LOAD = 1
SHT_SYMTAB = 2
STT_FUNC = 2
STT_OBJECT = 1


class Elf:
    """An image: `segments` as (physical address, bytes), `symbols` by name as (address, size)."""

    def __init__(self, data: bytes):
        if data[:6] != b"\x7fELF\x01\x01" or struct.unpack_from("<H", data, 18)[0] != 40:
            raise ValueError("this is no little-endian 32-bit ARM ELF file")
        phoff, shoff = struct.unpack_from("<II", data, 28)
        phentsize, phnum, shentsize, shnum = struct.unpack_from("<HHHH", data, 42)
        self.segments: list[tuple[int, bytes]] = []
        for index in range(phnum):
            kind, offset, _, physical, length = struct.unpack_from("<5I", data, phoff + index * phentsize)
            if kind == PT_LOAD and length:
                self.segments.append((physical, data[offset : offset + length]))
        self.symbols: dict[str, tuple[int, int]] = {}
        self._functions: list[tuple[int, int, str]] = []
        for index in range(shnum):
            header = struct.unpack_from("<10I", data, shoff + index * shentsize)
            if header[1] == SHT_SYMTAB:
                names = struct.unpack_from("<10I", data, shoff + header[6] * shentsize)
                self._read_symbols(data, header, names[4])
        self._functions.sort()
        self._starts = [start for start, _, _ in self._functions]

    @classmethod
    def open(cls, path: str) -> "Elf":
        """Reads a file."""
        with open(path, "rb") as file:
            return cls(file.read())

    def _read_symbols(self, data: bytes, header, names: int) -> None:
        for at in range(header[4], header[4] + header[5], header[9]):
            name_at, value, size, info, _, section = struct.unpack_from("<IIIBBH", data, at)
            if not name_at or not section:
                continue
            end = data.index(b"\0", names + name_at)
            name = data[names + name_at : end].decode()
            if info & 15 == STT_FUNC:
                self._functions.append((value & ~1, size, name))
                value &= ~1
            if not name.startswith("$"):
                self.symbols[name] = (value, size)

    def symbol_at(self, address: int) -> str | None:
        """Returns the function that holds an address, with the offset into it."""
        index = bisect.bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        start, size, name = self._functions[index]
        if address >= start + max(size, 2):
            return None
        return f"{readable(name)}+0x{address - start:x}"

    def find(self, name: str) -> tuple[int, int]:
        """Returns address and size of a symbol.

        The name is the full one, or a part that occurs in only one symbol. A path such as `crash::handler` matches Rust's
        mangled names, in which each part follows its length.
        """
        if name in self.symbols:
            return self.symbols[name]
        mangled = "".join(f"{len(part)}{part}" for part in name.split("::"))
        found = {self.symbols[symbol] for symbol in self.symbols if mangled in symbol or name in symbol}
        if len(found) != 1:
            raise KeyError(f"{len(found)} symbols fit {name!r}")
        return found.pop()


def readable(name: str) -> str:
    """Extracts the path from a name in Rust's legacy mangling: `_ZN4core3fmt5write17h0123456789abcdefE`."""
    if not (name.startswith("_ZN") and name.endswith("E")):
        return name
    parts, rest = [], name[3:-1]
    while rest and rest[0].isdigit():
        digits = len(rest) - len(rest.lstrip("0123456789"))
        length = int(rest[:digits])
        parts.append(rest[digits : digits + length])
        rest = rest[digits + length :]
    return "::".join(parts[:-1]) if parts and len(parts[-1]) == 17 else name
