"""Serves a board over standard input and output: one JSON object per line, answered by one JSON object per line.

Time passes only during the command `run`, so a test and the board are in lockstep.
"""

import argparse
import json
import sys

from .chips import CHIPS, STM32F405
from .session import Session
from .violation import Violation


def main() -> None:
    """Answers commands until standard input ends."""
    parser = argparse.ArgumentParser(prog="virtual_board", description=__doc__)
    parser.add_argument("--elf", required=True, help="the image, as it is flashed")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise in RAM at power-on")
    parser.add_argument("--chip", choices=CHIPS, default=STM32F405.name)
    arguments = parser.parse_args()
    session = Session(arguments.elf, arguments.seed, arguments.chip)
    for line in sys.stdin:
        try:
            answer = session.answer(json.loads(line))
        except Violation as violation:
            answer = {"error": str(violation), "violation": True}
        except Exception as error:  # The client hears of any error, and the board goes on.
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
