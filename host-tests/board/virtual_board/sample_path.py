"""Lists the source files that the image executes on the way of one sample: from the last byte of an MTi to a mailbox of CAN.

Run it in this folder: `python3 -m virtual_board.sample_path --elf ../../target/thumbv7em-none-eabihf/release/coprocessor`.
The image runs on the virtual board with a parked car. Once GyroNet's rates are sent, the blocks of instructions are noted
that interrupts execute between the tick that finds a sample's last byte and the request to send its first frame, for five
samples (a window's estimate is used every five). The debug lines of the image name the file of each instruction, inlined
functions included. What idle does meanwhile is not on the way, nor is GyroNet: its estimate is used two samples later.
"""

import argparse
import collections
import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

from unicorn import unicorn_const as const

from .processor import BLOCK
from .session import US, Session

#: The repository, whose files are counted.
ROOT = Path(__file__).resolve().parents[3]
#: Samples before the count, at 100 Hz: static initialisation takes 3 s.
BEFORE = 450
#: Samples that are counted.
COUNTED = 5
PERIOD_US = 10_000
#: The exception of the tick.
SYSTICK = 15
#: The registers of CAN1's mailboxes in which a frame is requested to be sent, and the bit that does it.
MAILBOXES = (0x4000_6580, 0x4000_6590, 0x4000_65A0)
REQUEST = 1


def message(number: int) -> bytes:
    """MTData2 of a parked car: a bias, gravity, and one bit of noise."""
    noise = 0.001 * (number % 2)
    packets = struct.pack(">HBH", 0x1020, 2, number & 0xFFFF)
    packets += struct.pack(">HBI", 0x1060, 4, 100 * number)
    packets += struct.pack(">HB3f", 0x4020, 12, noise, noise, 9.81 + noise)
    packets += struct.pack(">HB3f", 0x8020, 12, noise, noise, 0.01 + noise)
    packets += struct.pack(">HBI", 0xE020, 4, 3)
    body = bytes([0xFF, 0x36, len(packets)]) + packets
    return b"\xfa" + body + bytes([-sum(body) & 0xFF])


def executed(session: Session) -> set[int]:
    """Runs the board and returns the addresses that are executed between a sample's last byte and its first frame."""
    board = session.board
    session.power_on()
    session.run(us=200_000)
    begin = board.now / US
    for number in range(BEFORE):
        session.usart_send(1, message(number).hex(), begin + number * PERIOD_US)
    session.run(us=BEFORE * PERIOD_US)
    session.trace("CAN1", True)
    on_the_way: set[tuple[int, int]] = set()
    since_tick: set[tuple[int, int]] = set()
    before = 0

    def note(_, address: int, size: int, __) -> None:
        nonlocal before
        exception = board.processor.get("xpsr") & 0x1FF
        if exception == SYSTICK != before:
            since_tick.clear()
        if exception:
            since_tick.add((address, size))
        before = exception

    def requested(entry: dict | None) -> bool:
        return bool(entry and entry.get("access") == "write" and entry["address"] in MAILBOXES and entry["value"] & REQUEST)

    board.processor._hook(const.UC_HOOK_BLOCK, BLOCK(note))
    board.processor.forget_code()
    for number in range(BEFORE, BEFORE + COUNTED):
        session.usart_send(1, message(number).hex(), begin + number * PERIOD_US)
        board.watcher = requested
        board.run(board.now + PERIOD_US * US)
        board.watcher = None
        if not board.log or not requested(board.log[-1]):
            sys.exit(f"sample {number}: no frame is sent")
        on_the_way |= since_tick
        session.run(us=begin + (number + 1) * PERIOD_US - board.now / US)
        board.log.clear()
    return {at for address, size in on_the_way for at in range(address, address + size, 2)}


def files(elf: str, addresses: set[int]) -> dict[str, int]:
    """Returns the repository's files at these addresses, each with the number of its lines that are executed."""
    tool = next(filter(shutil.which, ("arm-none-eabi-addr2line", "llvm-addr2line", "addr2line")), None)
    if tool is None:
        sys.exit("addr2line is needed, from the binutils of any target")
    asked = "\n".join(f"{address:#x}" for address in sorted(addresses))
    answer = subprocess.run([tool, "-i", "-e", elf], input=asked, capture_output=True, text=True, check=True).stdout
    lines: dict[str, set[str]] = collections.defaultdict(set)
    for entry in answer.splitlines():
        found = re.match(r"(.*):(\d+)", entry)
        path = os.path.relpath(os.path.normpath(found[1]), ROOT) if found else ""
        if path.startswith("src/"):
            lines[path].add(found[2])
    return {name: len(numbers) for name, numbers in lines.items()}


def main() -> None:
    """Prints the list and its length."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elf", required=True, help="the image, as `cargo fw` builds it")
    parser.add_argument("--at-most", type=int, help="fail if there are more files")
    arguments = parser.parse_args()
    found = files(arguments.elf, executed(Session(arguments.elf, 1)))
    for name in sorted(found):
        print(f"{found[name]:5} {name}")
    images = sum(name.startswith("src/bin/") for name in found)
    print(f"{len(found)} files from MTi byte to CAN frame: {images} of the image, {len(found) - images} of the library")
    if arguments.at_most is not None and len(found) > arguments.at_most:
        sys.exit(f"more than {arguments.at_most}")


if __name__ == "__main__":
    main()
