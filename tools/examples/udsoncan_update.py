"""Updates a board's firmware over CAN with udsoncan: python udsoncan_update.py INTERFACE CHANNEL UPDATE [SIGNATURE]

INTERFACE and CHANNEL are python-can's, such as `socketcan can0` (up, at the bus's bit rate; other adapters get 500 kbit/s).
For `cargo board --parked` they are `slcan socket://localhost:4005`. UPDATE is written by `cargo fw`; a board with a key needs
the SIGNATURE of `gyronet sign` and a restart by its supply. Packages: can-isotp, python-can[serial], udsoncan.
"""

import logging
import sys
import time
from pathlib import Path

import can
import isotp
from udsoncan import DidCodec, MemoryLocation
from udsoncan.client import Client
from udsoncan.configs import default_client_config
from udsoncan.connections import PythonIsoTpConnection
from udsoncan.exceptions import NegativeResponseException, TimeoutException

REQUEST, RESPONSE = 0x7E0, 0x7E8  # often those of the engine: `gyronet device get` shows the board's
FIRMWARE, ADDRESS, USE = 0x011A, 2, 0xFF01
HEAD, LENGTH_OF_A = 161, slice(25, 29)
PROGRAMMING, HARD_RESET, CONDITIONS_NOT_CORRECT = 2, 1, 0x22


class Bytes(DidCodec):
    def encode(self, value):
        return value

    def decode(self, payload):
        return payload

    def __len__(self):
        raise DidCodec.ReadAllRemainingData


def transfer(client, number, block):
    """Sends a block again while the board proves its standstill, as after an erase, or answers another tester."""
    until = time.monotonic() + 30
    while True:
        try:
            return client.transfer_data(number & 0xFF, block)
        except (NegativeResponseException, TimeoutException) as error:
            code = getattr(error, "response", None) and error.response.code
            if code not in (None, CONDITIONS_NOT_CORRECT) or time.monotonic() > until:
                raise
            time.sleep(0.5)


def update(client, file, signature):
    runs = client.read_data_by_identifier(FIRMWARE).service_data.values[FIRMWARE]
    head, images = file[:HEAD], file[HEAD:]
    split = int.from_bytes(head[LENGTH_OF_A])
    image = images[split:] if runs[0] == 0 else images[:split]  # the one for the slot that does not run
    client.change_session(PROGRAMMING)
    client.write_data_by_identifier(FIRMWARE, head + signature)
    length = client.request_download(MemoryLocation(ADDRESS, len(image), 32, 32)).service_data.max_length - 2
    for number, start in enumerate(range(0, len(image), length), 1):
        transfer(client, number, image[start : start + length])
        if number % 50 == 0:
            print(f"{start} of {len(image)} bytes", flush=True)
    client.request_transfer_exit()
    client.start_routine(USE)
    print("the image starts on trial; `gyronet device info` says within a minute whether it is confirmed", flush=True)
    if signature:
        print("switch the supply off and on")
    else:
        client.ecu_reset(HARD_RESET)


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    interface, channel, *names = sys.argv[1:]
    file, signature = [*(Path(name).read_bytes() for name in names), b""][:2]
    # The board answers within 50 ms (P2); this computer and its adapter take a time of their own.
    config = default_client_config | {"data_identifiers": {FIRMWARE: Bytes}, "use_server_timing": False}
    address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=REQUEST, rxid=RESPONSE)
    with can.Bus(interface=interface, channel=channel, bitrate=500_000) as bus:
        layer = isotp.CanStack(bus, address=address, params={"tx_padding": 0xAA})
        with Client(PythonIsoTpConnection(layer), config=config) as client:
            client.logger.setLevel(logging.CRITICAL)  # a block that is refused once is no alarm
            try:
                update(client, file, signature)
            except (NegativeResponseException, TimeoutException) as error:
                sys.exit(f"{names[0]}: {error} (src/can/README.md says what to do where a request is refused)")


if __name__ == "__main__":
    main()
