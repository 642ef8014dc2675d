"""DMA controllers in direct mode (RM0090 section 10): requests of the serial lines move bytes between a data register and memory.

A request is served at once, or several at a time, before anything can observe them. CCM RAM is not on the DMA's bus: an access there
is a transfer error (section 2.3.1). Reception is circular; a transmission ends the stream.
Left out: interrupts, items wider than a byte, the FIFO (DMDIS = 1), bursts, double buffers, memory to memory, an incremented peripheral
address, peripheral flow control, priorities, accesses to parts of registers.
Assumed where the manual is silent: a stream that is enabled with old flags set starts anyway, and `dma_flags` is recorded.
"""

from ..violation import Violation
from .registers import Registers

EN, TO_PERIPHERAL, CIRC, MINC = 1, 1 << 6, 1 << 8, 1 << 10
#: Channel, priority, direction and mode: what a stream may ask for.
MODES = 7 << 25 | 3 << 16 | MINC | CIRC | TO_PERIPHERAL | EN
TEIF, HTIF, TCIF = 1 << 3, 1 << 4, 1 << 5
FLAG_SHIFTS = (0, 6, 16, 22)
CCM = range(0x1000_0000, 0x1001_0000)
#: Requests by (stream, channel): tables 42 and 43, those of the modelled peripherals.
REQUESTS = {
    "DMA1": {(1, 4): "USART3_RX", (3, 4): "USART3_TX", (4, 7): "USART3_TX", (2, 4): "UART4_RX", (4, 4): "UART4_TX",
             (5, 4): "USART2_RX", (6, 4): "USART2_TX"},
    "DMA2": {(2, 4): "USART1_RX", (5, 4): "USART1_RX", (7, 4): "USART1_TX", (1, 5): "USART6_RX", (2, 5): "USART6_RX",
             (6, 5): "USART6_TX", (7, 5): "USART6_TX"},
}


class Stream:
    """The registers of one stream and its progress."""

    def __init__(self):
        self.cr = self.par = self.m0ar = self.flags = 0
        self.left = self.total = 0
        #: The peripheral that PAR points to, found when the stream is enabled.
        self.peripheral = None

    @property
    def memory(self):
        """Returns the address of the next byte."""
        return self.m0ar + (self.total - self.left)


class Dma(Registers):
    """DMA1 or DMA2 with eight streams."""

    kept = {0x08: (0, 0), 0x0C: (0, 0)}

    def __init__(self, board, name, base):
        super().__init__(board)
        self.name = self.clock = name
        self.base = base
        self.requests = REQUESTS[name]
        self.streams = [Stream() for _ in range(8)]
        self.by_request = {}
        #: The peripherals that the enabled streams serve.
        self.sources = []

    def reset(self, cause):
        self.streams = [Stream() for _ in range(8)]
        self.by_request, self.sources = {}, []

    # -- transfers ---------------------------------------------------------------------------------------------------

    def request(self, name):
        """Serves one transfer for a peripheral; returns False if no enabled stream handles the request.

        The bus bridge converts an item of any size to a word.
        """
        number = self.by_request.get(name)
        if number is None:
            return False
        stream = self.streams[number]
        offset = stream.par - stream.peripheral.base
        if stream.memory in CCM:
            stream.flags |= TEIF
            self.board.record("dma_error", dma=self.name, stream=number)
            self._disable(number)
        elif stream.cr & TO_PERIPHERAL:
            value = self.give(name, 1)[0]
            stream.peripheral.write(offset, value, 4)
        else:
            self.take(name, bytes([stream.peripheral.read(offset, 4) & 0xFF]))
        return not stream.flags & TEIF

    def _at(self, address):
        for peripheral in self.board.peripherals.values():
            if peripheral.base <= address < peripheral.base + peripheral.size:
                return peripheral
        raise Violation(f"{self.name}: PAR {address:#x} belongs to no modelled peripheral")

    def take(self, name, data):
        """Writes received bytes to memory, in circular mode."""
        stream = self.streams[self.by_request[name]]
        while data:
            part, data = data[:stream.left], data[stream.left:]
            self.board.memory_write(stream.memory, part)
            half = stream.total // 2
            stream.flags |= HTIF if stream.left > half >= stream.left - len(part) else 0
            stream.left -= len(part)
            if not stream.left:
                stream.flags |= TCIF
                stream.left = stream.total

    def give(self, name, count):
        """Reads bytes to send from memory."""
        number = self.by_request[name]
        stream = self.streams[number]
        data = self.board.memory_read(stream.memory, count)
        half = stream.total // 2
        stream.flags |= HTIF if stream.left > half >= stream.left - count else 0
        stream.left -= count
        if not stream.left:
            stream.flags |= TCIF
            self._disable(number)
        return data

    def serves(self, name):
        """Returns whether a stream writes the bytes of a request to memory."""
        number = self.by_request.get(name)
        return number is not None and self.streams[number].m0ar not in CCM

    def feeds(self, name):
        """Returns the number of bytes that a stream will still read from memory for a request."""
        number = self.by_request.get(name)
        return self.streams[number].left if number is not None and self.streams[number].m0ar not in CCM else 0

    def _catch_up(self):
        for source in list(self.sources):
            source.catch_up()

    def _source(self, name):
        return self.board.peripherals[name.rsplit("_", 1)[0]]

    def _disable(self, number):
        stream = self.streams[number]
        stream.cr &= ~EN
        self._serve({name: other for name, other in self.by_request.items() if other != number})

    def _serve(self, by_request):
        self.by_request = by_request
        self.sources = [self._source(name) for name in by_request]

    # -- registers ---------------------------------------------------------------------------------------------------

    def load(self, offset):
        self._catch_up()
        if offset in (0x00, 0x04):
            return sum(self.streams[offset + index].flags << shift for index, shift in enumerate(FLAG_SHIFTS))
        if 0x10 <= offset < 0xD0:
            stream = self.streams[(offset - 0x10) // 0x18]
            return (stream.cr, stream.left, stream.par, stream.m0ar, 0, 0x21)[(offset - 0x10) % 0x18 // 4]
        return super().load(offset)

    def store(self, offset, value):
        self._catch_up()
        if offset in (0x08, 0x0C):
            for index, shift in enumerate(FLAG_SHIFTS):
                self.streams[offset - 8 + index].flags &= ~(value >> shift & 0x3D)
        elif 0x10 <= offset < 0xD0:
            self._write_stream((offset - 0x10) // 0x18, (offset - 0x10) % 0x18 // 4, value)
        else:
            super().store(offset, value)
        self._catch_up()

    def _write_stream(self, number, register, value):
        stream = self.streams[number]
        if register == 0:
            self._write_cr(number, value)
        elif stream.cr & EN:
            self.board.record("ignored_write", register=f"{self.name} stream {number}", value=value)
        elif register == 1:
            stream.left = stream.total = value & 0xFFFF
        elif register > 3:
            raise Violation(f"{self.name}: double buffers and the FIFO are not modelled")
        else:
            setattr(stream, ("", "", "par", "m0ar")[register], value)

    def _write_cr(self, number, value):
        stream = self.streams[number]
        is_sending = bool(value & TO_PERIPHERAL)
        if stream.cr & EN and not value & EN:
            self._disable(number)
            stream.flags |= TCIF
            return
        if stream.cr & EN:
            self.board.record("ignored_write", register=f"{self.name} stream {number}", value=value)
            return
        if value & EN and (value & ~MODES or not value & MINC or is_sending == bool(value & CIRC)):
            raise Violation(f"{self.name}: stream {number} asks for a mode that is not modelled (CR {value:#x})")
        name = self.requests.get((number, value >> 25 & 7), "")
        if value & EN and not name.endswith("_TX" if is_sending else "_RX"):
            raise Violation(f"{self.name}: stream {number} has no modelled request on channel {value >> 25 & 7}")
        stream.cr = value
        if not value & EN:
            return
        if stream.flags:
            self.board.record("dma_flags", dma=self.name, stream=number, flags=stream.flags)
        if not stream.left:
            stream.cr &= ~EN
            return
        stream.total = stream.left
        stream.peripheral = self._at(stream.par)
        self._serve(self.by_request | {name: number})
        self._source(name).serve_dma()
