"""Peripherals of the STM32F405, one file each, written from RM0090 and the data sheets."""

from .asm330lhh import Asm330lhh
from .bmi088 import Bmi088
from .bxcan import BxCan
from .dbgmcu import Dbgmcu
from .dma import Dma
from .exti import Exti
from .flash import Flash
from .gpio import Gpio
from .icm42688 import Icm42688
from .iwdg import Iwdg
from .pwr import Pwr
from .rcc import Rcc
from .rng import Rng
from .spi import Spi
from .timer import timers
from .usart import usarts


def fit(board, spi, select, second):
    """Fits an inertial sensor to SPI1, each chip select at a pin of a port."""
    icm42688, bmi088, asm330lhh = Icm42688(board), Bmi088(board), Asm330lhh(board)
    spi.attach(icm42688, [(icm42688, *select)])
    spi.attach(bmi088, [(bmi088.accelerometer, *select), (bmi088.gyro, *second)])
    spi.attach(asm330lhh, [(asm330lhh, *select)])


def create(board):
    """Creates all modelled peripherals, with an inertial sensor on SPI1: an ICM-42688-P or ASM330LHH at PA4, or a BMI088 at PA4 and
    PC4.

    The clock tree comes first, because the others read their clocks from it.
    """
    ports = [Gpio(board, letter) for letter in "ABCDEFGHI"]
    spi = Spi(board)
    fit(board, spi, (ports[0], 4), (ports[2], 4))
    return [Rcc(board), Pwr(board), Flash(board), Exti(board), *ports, Dbgmcu(board),
            Iwdg(board), *usarts(board), *timers(board), BxCan(board), spi,
            Dma(board, "DMA1", 0x4002_6000), Dma(board, "DMA2", 0x4002_6400), Rng(board)]
