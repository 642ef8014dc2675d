"""DMA controllers in direct mode (RM0090 section 10): requests of peripherals move items between a data register and memory.

A request is served at once; requests that raise no interrupt may be served several at a time, before anything can observe them. CCM
RAM is not on the DMA's bus: an access there is a transfer error (section 2.3.1).
Left out: the FIFO (DMDIS = 1), bursts, memory to memory, PINCOS, peripheral flow control, different sizes on both sides, priorities.
Assumed where the manual is silent: a stream that is enabled with old flags set starts anyway, and `dma_flags` is recorded.
"""

from ..peripheral import Peripheral
from ..violation import Violation
from . import registers

EN, TEIE, HTIE, TCIE = 1, 4, 8, 16
TO_MEMORY, TO_PERIPHERAL = 0, 1
CIRC, PINC, MINC, DBM, CT = 1 << 8, 1 << 9, 1 << 10, 1 << 18, 1 << 19
TEIF, HTIF, TCIF = 1 << 3, 1 << 4, 1 << 5
FLAG_SHIFTS = (0, 6, 16, 22)
CCM = range(0x1000_0000, 0x1001_0000)
#: Requests by (stream, channel): tables 42 and 43, those of the modelled peripherals.
REQUESTS = {
    "DMA1": {(0, 0): "SPI3_RX", (2, 0): "SPI3_RX", (5, 0): "SPI3_TX", (7, 0): "SPI3_TX", (3, 0): "SPI2_RX", (4, 0): "SPI2_TX",
             (0, 4): "UART5_RX", (7, 4): "UART5_TX", (1, 4): "USART3_RX", (3, 4): "USART3_TX", (4, 7): "USART3_TX",
             (2, 4): "UART4_RX", (4, 4): "UART4_TX", (5, 4): "USART2_RX", (6, 4): "USART2_TX"},
    "DMA2": {(0, 3): "SPI1_RX", (2, 3): "SPI1_RX", (3, 3): "SPI1_TX", (5, 3): "SPI1_TX", (2, 4): "USART1_RX", (5, 4): "USART1_RX",
             (7, 4): "USART1_TX", (1, 5): "USART6_RX", (2, 5): "USART6_RX", (6, 5): "USART6_TX", (7, 5): "USART6_TX"},
}
INTERRUPTS = {"DMA1": (11, 12, 13, 14, 15, 16, 17, 47), "DMA2": (56, 57, 58, 59, 60, 68, 69, 70)}


class Stream:
    """The registers of one stream and its progress."""

    def __init__(self):
        self.cr = self.ndtr = self.par = self.m0ar = self.m1ar = 0
        self.fcr = 0x21
        self.flags = 0
        self.left = self.total = 0
        #: The peripheral that PAR points to, found when the stream is enabled.
        self.peripheral = None

    @property
    def width(self):
        """Returns the size of an item in bytes."""
        return 1 << (self.cr >> 11 & 3)


class Dma(Peripheral):
    """DMA1 or DMA2 with eight streams."""

    def __init__(self, board, name, base):
        super().__init__(board)
        self.name = self.clock = name
        self.base = base
        self.interrupts = INTERRUPTS[name]
        self.requests = REQUESTS[name]
        self.streams = [Stream() for _ in range(8)]
        self.by_request = {}
        #: The peripherals that the enabled streams serve.
        self.sources = []

    def reset(self, cause):
        self.streams = [Stream() for _ in range(8)]
        self.by_request, self.sources = {}, []
        for number in self.interrupts:
            self.board.irq(number, False)

    # -- transfers ---------------------------------------------------------------------------------------------------

    def request(self, name):
        """Serves one transfer for a peripheral; returns False if no enabled stream handles the request.

        The bus bridge converts an item of any size to a word.
        """
        number = self.by_request.get(name)
        if number is None:
            return False
        stream = self.streams[number]
        width = stream.width
        done = stream.total - stream.left
        memory = stream.m1ar if stream.cr & DBM and stream.cr & CT else stream.m0ar
        if stream.cr & MINC:
            memory += done * width
        offset = stream.par - stream.peripheral.base + (done * width if stream.cr & PINC else 0)
        if memory in CCM:
            self._fail(number)
            return False
        peripheral = stream.peripheral
        if stream.cr >> 6 & 3 == TO_MEMORY:
            item = peripheral.read(offset, 4) & (1 << 8 * width) - 1
            self.board.memory_write(memory, item.to_bytes(width, "little"))
            self._advance(number)
        else:
            value = int.from_bytes(self.board.memory_read(memory, width), "little")
            self._advance(number)
            peripheral.write(offset, value, 4)
        return True

    def _at(self, address):
        for peripheral in self.board.peripherals.values():
            if peripheral.base <= address < peripheral.base + peripheral.size:
                return peripheral
        raise Violation(f"{self.name}: PAR {address:#x} belongs to no modelled peripheral")

    def _advance(self, number):
        stream = self.streams[number]
        stream.left -= 1
        if stream.left == stream.total // 2:
            stream.flags |= HTIF
        if stream.left == 0:
            stream.flags |= TCIF
            if stream.cr & (CIRC | DBM):
                stream.left = stream.total
                if stream.cr & DBM:
                    stream.cr ^= CT
            else:
                self._disable(number)
        if stream.cr & (TEIE | HTIE | TCIE):
            self._interrupt(number)

    def take(self, name, data):
        """Writes bytes to memory for a stream that serves silently, as if they had been requested one by one."""
        stream = self.streams[self.by_request[name]]
        while data:
            part, data = data[:stream.left], data[stream.left:]
            self.board.memory_write(stream.m0ar + stream.total - stream.left, part)
            half = stream.total // 2
            stream.flags |= HTIF if stream.left > half >= stream.left - len(part) else 0
            stream.left -= len(part)
            if not stream.left:
                stream.flags |= TCIF
                stream.left = stream.total

    def give(self, name, count):
        """Reads bytes from memory for a stream that feeds silently, as if they had been requested one by one."""
        number = self.by_request[name]
        stream = self.streams[number]
        data = self.board.memory_read(stream.m0ar + stream.total - stream.left, count)
        half = stream.total // 2
        stream.flags |= HTIF if stream.left > half >= stream.left - count else 0
        stream.left -= count
        if not stream.left:
            stream.flags |= TCIF
            self._disable(number)
        return data

    def serves_silently(self, name):
        """Returns whether a stream writes bytes to memory in circular mode without an interrupt."""
        number = self.by_request.get(name)
        if number is None:
            return False
        stream = self.streams[number]
        mode = stream.cr & (CIRC | MINC | PINC | DBM | 3 << 11 | 3 << 6 | TEIE | HTIE | TCIE)
        return mode == CIRC | MINC and stream.m0ar not in CCM

    def feeds_silently(self, name):
        """Returns the number of bytes that a stream will still read from memory, if it raises no interrupt; else 0."""
        number = self.by_request.get(name)
        if number is None:
            return 0
        stream = self.streams[number]
        mode = stream.cr & (CIRC | MINC | PINC | DBM | 3 << 11 | 3 << 6 | TEIE | HTIE | TCIE)
        return stream.left if mode == MINC | TO_PERIPHERAL << 6 and stream.m0ar not in CCM else 0

    def _catch_up(self):
        for source in list(self.sources):
            source.catch_up()

    def _source(self, name):
        return self.board.peripherals[name.rsplit("_", 1)[0]]

    def _fail(self, number):
        self.streams[number].flags |= TEIF
        self.board.record("dma_error", dma=self.name, stream=number)
        self._disable(number)
        self._interrupt(number)

    def _disable(self, number):
        stream = self.streams[number]
        stream.cr &= ~EN
        self._serve({name: other for name, other in self.by_request.items() if other != number})

    def _serve(self, by_request):
        self.by_request = by_request
        self.sources = [self._source(name) for name in by_request]

    def _interrupt(self, number):
        stream = self.streams[number]
        enabled = (TEIF if stream.cr & TEIE else 0) | (HTIF if stream.cr & HTIE else 0) | (TCIF if stream.cr & TCIE else 0)
        self.board.irq(self.interrupts[number], bool(stream.flags & enabled))

    # -- registers ---------------------------------------------------------------------------------------------------

    def read(self, offset, size):
        self._catch_up()
        word = offset & ~3
        if word in (0x00, 0x04):
            value = sum(self.streams[word + index].flags << shift for index, shift in enumerate(FLAG_SHIFTS))
        elif word in (0x08, 0x0C):
            value = 0
        elif 0x10 <= word < 0xD0:
            stream = self.streams[(word - 0x10) // 0x18]
            value = (stream.cr, stream.left, stream.par, stream.m0ar, stream.m1ar, stream.fcr)[(word - 0x10) % 0x18 // 4]
        else:
            raise registers.unmodelled(self, offset, "read")
        return registers.cut(value, offset, size)

    def write(self, offset, value, size):
        self._catch_up()
        self._write(offset, value, size)
        self._catch_up()

    def _write(self, offset, value, size):
        word = offset & ~3
        value = registers.merge(0 if word < 0x10 else self.read(word, 4), value, offset, size)
        if word in (0x08, 0x0C):
            for index, shift in enumerate(FLAG_SHIFTS):
                number = word - 8 + index
                self.streams[number].flags &= ~(value >> shift & 0x3D)
                self._interrupt(number)
        elif 0x10 <= word < 0xD0:
            self._write_stream((word - 0x10) // 0x18, (word - 0x10) % 0x18 // 4, value)
        else:
            raise registers.unmodelled(self, offset, "write")

    def _write_stream(self, number, register, value):
        stream = self.streams[number]
        if register == 0:
            self._write_cr(number, value)
        elif stream.cr & EN and not (register in (3, 4) and stream.cr & DBM):
            self.board.record("ignored_write", register=f"{self.name} stream {number}", value=value)
        elif register == 1:
            stream.left = stream.total = value & 0xFFFF
        elif register == 5:
            if value & 4:
                raise Violation(f"{self.name}: the FIFO (DMDIS = 1) is not modelled")
            stream.fcr = value & 0x87 | stream.fcr & 0x38
        else:
            setattr(stream, ("", "", "par", "m0ar", "m1ar")[register], value)

    def _write_cr(self, number, value):
        stream = self.streams[number]
        if stream.cr & EN:
            stream.cr = stream.cr & ~0x1F | value & 0x1F
            if not value & EN:
                self._disable(number)
                stream.flags |= TCIF
            self._interrupt(number)
            return
        stream.cr = value & 0x0FEF_FFFF
        if not value & EN:
            return
        if value >> 6 & 3 > TO_PERIPHERAL or value & 0x01E0_8020 or value >> 11 & 3 != value >> 13 & 3:
            raise Violation(f"{self.name}: stream {number} asks for a mode that is not modelled (CR {value:#x})")
        name = self.requests.get((number, value >> 25 & 7))
        if name is None:
            raise Violation(f"{self.name}: stream {number} has no modelled request on channel {value >> 25 & 7}")
        if stream.flags:
            self.board.record("dma_flags", dma=self.name, stream=number, flags=stream.flags)
        if not stream.left:
            stream.cr &= ~EN
            return
        stream.total = stream.left
        stream.peripheral = self._at(stream.par)
        self._serve(self.by_request | {name: number})
        self._source(name).serve_dma()
