"""Reads and writes by udsoncan over can-isotp, both with their default settings, on the SLCAN socket of `cargo board`.

`socket_client.py HOST:PORT UPDATE`. The board's P2 of 50 ms holds from the session on, and runs while a long request is sent.
Prints the longest time from a request to its response, ms.
"""

import socket
import sys
import time
from pathlib import Path

import isotp
from uds_client import CONFIG, RESPONSE, SERVER
from udsoncan.client import Client
from udsoncan.connections import PythonIsoTpConnection
from udsoncan.services import DiagnosticSessionControl

HEAD = 161


class Slcan:
    """An SLCAN line as a socket."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.text = b""
        self.socket.sendall(b"\rO\r")

    def send(self, frame):
        self.socket.sendall(f"t{frame.arbitration_id:03X}{len(frame.data)}{frame.data.hex().upper()}\r".encode())

    def receive(self, timeout):
        """Returns the next response, if there is one in time; the frames of the rates are passed over."""
        until = time.monotonic() + timeout
        while True:
            line, found, rest = self.text.partition(b"\r")
            if found:
                self.text = rest
                line = line.lstrip(b"\x07").decode()
                if line.startswith(f"t{RESPONSE:03X}"):
                    length = int(line[4])
                    return isotp.CanMessage(arbitration_id=RESPONSE, data=bytes.fromhex(line[5:5 + 2 * length]))
                continue
            self.socket.settimeout(max(until - time.monotonic(), 1e-4))
            try:
                self.text += self.socket.recv(4096)
            except TimeoutError:
                return None


def main():
    line, head = Slcan(sys.argv[1]), Path(sys.argv[2]).read_bytes()[:HEAD]
    address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=SERVER, rxid=RESPONSE)
    layer = isotp.TransportLayer(line.receive, line.send, address, params={"tx_padding": 0xAA})
    longest = 0.0
    with Client(PythonIsoTpConnection(layer), config=CONFIG) as client:
        def timed(call, *arguments):
            nonlocal longest
            began = time.monotonic()
            response = call(*arguments)
            longest = max(longest, time.monotonic() - began)
            return response

        for session in (DiagnosticSessionControl.Session.extendedDiagnosticSession,
                        DiagnosticSessionControl.Session.programmingSession):  # fmt: skip
            client.change_session(session)
            for did in (0x0104, 0x011A):
                timed(client.read_data_by_identifier, did)
        for _ in range(3):
            timed(client.write_data_by_identifier, 0x011A, head)
    print(round(1000 * longest, 1))


if __name__ == "__main__":
    main()
