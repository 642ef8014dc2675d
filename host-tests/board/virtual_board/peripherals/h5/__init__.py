"""Peripherals of the STM32H563, as far as an image of the NUCLEO-H563ZI touches them.

RM0481 was not at hand as a whole. Where a file names no section, its witnesses are code: ST's header stm32h563xx.h (addresses,
offsets, bits, interrupts), ST's SVD file (reset values), ST's HAL (sequences, message RAM, flash latencies). What the silicon
shares with the STM32F405 (GPIO, timers, IWDG, the core of a USART, bus and error rules of CAN) is that model.
"""

from ..gpio import Gpio
from ..iwdg import Iwdg
from ..timer import Timer
from .fdcan import Fdcan, MessageRam
from .flash import Flash
from .rcc import Rcc
from .rng import Rng
from .spi import Spi
from .system import Dbgmcu, Pwr, Sbs
from .usart import usarts

#: Reset values of MODER, OSPEEDR and PUPDR: all pins are analog but those of the debug port.
PINS = {"A": (0xABFF_FFFF, 0x0C00_0000, 0x6400_0000), "B": (0xFFFF_FEBF, 0x0000_00C0, 0x0000_0100)}
ANALOG = (0xFFFF_FFFF, 0, 0)


class Port(Gpio):
    """A port at its address on this chip."""

    def __init__(self, board, letter):
        super().__init__(board, letter, 0x4202_0000, PINS.get(letter, ANALOG))


class Watchdog(Iwdg):
    """The IWDG with its window and early wake-up registers, which must keep their reset values."""

    PRESCALERS = 8
    #: WINR and EWCR: reset value.
    FIXED = {0x10: 0xFFF, 0x14: 0}

    def load(self, offset):
        if offset in self.FIXED:
            return self.FIXED[offset]
        # SR.ONF: the watchdog runs.
        return super().load(offset) | (1 << 8 if offset == 0x0C and self.running else 0)

    def store(self, offset, value):
        if self.FIXED.get(offset) != value:
            super().store(offset, value)


def create(board):
    """Creates all modelled peripherals, the clock tree first."""
    from .. import fit

    can, spi, ports = Fdcan(board), Spi(board), [Port(board, letter) for letter in "ABCDEFGHI"]
    fit(board, spi, (ports[3], 14), (ports[3], 15))
    return [Rcc(board), Pwr(board), Flash(board), *ports, Sbs(board), spi, Dbgmcu(board), Rng(board), Watchdog(board), *usarts(board), Timer(board, "TIM2", 0x4000_0000, 45, "TIM_APB1", 32, 4),
            can, MessageRam(board, can)]
