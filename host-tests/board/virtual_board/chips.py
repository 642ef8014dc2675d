"""The parts of a chip outside its peripherals: memories, processor and interrupts."""

from typing import NamedTuple

from unicorn import arm_const as arm

FLASH = 0x0800_0000
SRAM = 0x2000_0000


class Chip(NamedTuple):
    """One part. Each memory is its address and its size."""

    name: str
    model: int
    cpuid: int
    interrupts: int
    #: EXC_RETURN of a return to Handler mode with the FPU's registers; the others have more bits set.
    exc_return: int
    flash_size: int
    sram_size: int
    #: RAM on the data bus alone, from which nothing is fetched.
    data_ram: tuple[int, int] | None
    #: Read-only memory of the maker.
    system: tuple[int, int]
    unique_id: int
    flash_kib: int
    #: Where the vectors lie after a reset: at 0 flash appears a second time.
    boot: int


#: RM0090 sections 2.3, 2.4, 12.1 and 39.1; system memory up to the page of the option bytes (table 5). Cortex-M4 r0p1.
STM32F405 = Chip("stm32f405", arm.UC_CPU_ARM_CORTEX_M4, 0x410F_C241, 82, 0xFFFF_FFE1, 1 << 20, 128 << 10,
                 (0x1000_0000, 64 << 10), (0x1FFF_0000, 0xC400), 0x1FFF_7A10, 0x1FFF_7A22, 0)
#: A Cortex-M33 r0p4 without TrustZone (TZEN off): SRAM1 to 3 follow each other, and reset starts at NSBOOTADD's default. The
#: addresses are those of ST's header stm32h563xx.h (UID_BASE, FLASHSIZE_BASE), which was the witness here; EXC_RETURN of the
#: non-secure state is of DDI0553 (D1.2.95).
STM32H563 = Chip("stm32h563", arm.UC_CPU_ARM_CORTEX_M33, 0x410F_D214, 131, 0xFFFF_FFA0, 2 << 20, 640 << 10,
                 None, (0x08FF_F000, 0x1000), 0x08FF_F800, 0x08FF_F80C, FLASH)
CHIPS = {chip.name: chip for chip in (STM32F405, STM32H563)}
