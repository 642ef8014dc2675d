"""Diagnoses the board with udsoncan over can-isotp, as they are published.

`uds_client.py WEIGHTS` reads and writes over a bus that is two pipes, with the key and signatures in WEIGHTS.json and an
update in WEIGHTS.update: each line "turn ID#DATA ..." that goes out carries the frames of a millisecond, and the line that
comes back the server's frames. Both packages run with their default settings, and their clock counts these turns.
"""

import json
import struct
import sys
import time
from pathlib import Path

import isotp
import udsoncan
import yaml
from udsoncan.client import Client
from udsoncan.connections import BaseConnection
from udsoncan.exceptions import NegativeResponseException, TimeoutException
from udsoncan.services import ControlDTCSetting, DiagnosticSessionControl, ECUReset

SERVER, ALL, RESPONSE = 0x7E0, 0x7DF, 0x7E8


class Pipes(BaseConnection):
    """Carries whole messages: can-isotp cuts them into frames, the pipes carry the frames."""

    def __init__(self):
        super().__init__("pipes")
        self.received = []
        self.outgoing = []
        self.turns = 0
        for module in (udsoncan.client, isotp.protocol, isotp.tools):
            module.time = self
        address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=SERVER, rxid=RESPONSE)
        self.layer = isotp.TransportLayerLogic(self.take, self.outgoing.append, address, params={"tx_padding": 0xAA},
                                               error_handler=self.fail)
        self.errors = []

    def monotonic(self):
        return self.turns / 1000

    perf_counter, sleep = monotonic, staticmethod(time.sleep)

    def perf_counter_ns(self):
        return self.turns * 1_000_000

    def fail(self, error):
        self.errors.append(error)

    def take(self, _timeout=0):
        return self.received.pop(0) if self.received else None

    def turn(self):
        """Lets a millisecond pass."""
        self.turns += 1
        self.layer.process(0)
        frames = " ".join(f"{frame.arbitration_id:x}#{frame.data.hex()}" for frame in self.outgoing)
        self.outgoing.clear()
        print("turn", frames, flush=True)
        for data in sys.stdin.readline().split():
            self.received.append(isotp.CanMessage(arbitration_id=RESPONSE, dlc=8, data=bytes.fromhex(data)))
        self.layer.process(0)

    def specific_send(self, payload, timeout=None):
        self.layer.send(payload)

    def specific_wait_frame(self, timeout=None):
        until = self.monotonic() + timeout
        while self.monotonic() < until:
            self.turn()
            if self.layer.available():
                return bytes(self.layer.recv())
        raise TimeoutException(f"no message in {timeout} s; {self.errors}")

    def open(self):
        return self

    def close(self):
        pass

    def empty_rxqueue(self):
        self.layer.recv()

    def is_open(self):
        return True


class Bytes(udsoncan.DidCodec):
    """Leaves data as they are."""

    def encode(self, value):
        return value

    def decode(self, payload):
        return payload

    def __len__(self):
        raise udsoncan.DidCodec.ReadAllRemainingData


def refused(code, call, *arguments, **named):
    """Expects a negative response."""
    try:
        call(*arguments, **named)
    except NegativeResponseException as error:
        assert error.response.code == code, error
    else:
        raise AssertionError(f"{call} was not refused with {code:02x}")


DESCRIPTION = yaml.safe_load((Path(__file__).parents[3] / "tools/gyronet_uds.yaml").read_text())
DIDS = DESCRIPTION["data"]
CODECS = {did: Bytes if data["format"] == "bytes" else data["format"]
          for did, data in (DIDS | DESCRIPTION["write_only"]).items()}
CONFIG = dict(udsoncan.configs.default_client_config, data_identifiers=CODECS)


def examine(client):
    """Reads everything, and leaves the board in an extended session."""
    for did in DIDS:
        value = client.read_data_by_identifier(did).service_data.values[did]
        print(f"{did:04x} {DESCRIPTION['data'][did]['name']}: {value}")
        fields = DESCRIPTION["data"][did].get("fields", [])
        assert value is not None and (not fields or len(fields) == len(value)), did
    place = udsoncan.MemoryLocation(0, 4, 32, 32)
    refused(0x7F, client.request_download, place)
    troubles = client.get_supported_dtc().service_data.dtcs
    assert {trouble.id for trouble in troubles} == set(DESCRIPTION["troubles"]), troubles
    client.change_session(DiagnosticSessionControl.Session.extendedDiagnosticSession)
    client.tester_present()
    client.control_dtc_setting(ControlDTCSetting.SettingType.off)
    client.control_dtc_setting(ControlDTCSetting.SettingType.on)
    client.clear_dtc()
    number = client.get_number_of_dtc_by_status_mask(0x08).service_data.dtc_count
    print(f"{number} troubles after they were cleared")
    client.start_routine(0x0204)
    return client.read_data_by_identifier(0x0100).service_data.values[0x0100]


def write(client, pipes, weights, signed):
    """Writes a configuration, a key, and a weight file that runs once its signature is right."""
    configuration = examine(client)
    client.write_data_by_identifier(0x0100, configuration)
    refused(0x13, client.write_data_by_identifier, 0x0100, configuration[:-1])
    refused(0x31, client.write_data_by_identifier, 0xF186, 1)
    client.write_data_by_identifier(0x0110, bytes.fromhex(signed["public"]))
    client.change_session(DiagnosticSessionControl.Session.programmingSession)
    refused(0x33, client.ecu_reset, ECUReset.ResetType.hardReset)
    download(client, 0, weights)
    refused(0x13, client.start_routine, 0xFF01)
    refused(0x35, client.start_routine, 0xFF01, bytes.fromhex(signed["foreign"]))
    client.start_routine(0xFF01, bytes.fromhex(signed["good"]))
    # Again is a replay.
    refused(0x31, client.start_routine, 0xFF01, bytes.fromhex(signed["good"]))
    state, counter, _, _ = client.read_data_by_identifier(0x0111).service_data.values[0x0111]
    assert (state, counter) == (1, 7), (state, counter)
    print("reset", flush=True)
    for _ in range(300):
        pipes.turn()
    source, crc = client.read_data_by_identifier(0x0103).service_data.values[0x0103]
    assert (source, crc) == (2, struct.unpack("<I", weights[-4:])[0]), (source, crc)
    assert not pipes.errors, pipes.errors


def download(client, address, content):
    """Sends a file in blocks, and has it checked."""
    place = udsoncan.MemoryLocation(address, len(content), 32, 32)
    length = client.request_download(place).service_data.max_length - 2
    for number, start in enumerate(range(0, len(content), length), 1):
        client.transfer_data(number & 0xFF, content[start:start + length])
        if number == 1 and len(content) > length:
            # A file that is cut.
            refused(0x24, client.request_transfer_exit)
    client.request_transfer_exit()


def update(client, pipes, file, signature):
    """Updates the firmware to an image that does not start, which is rolled back."""
    head, images = file[:161], file[161:]
    slot, state, *_crc = client.read_data_by_identifier(0x011A).service_data.values[0x011A]
    assert (slot, state) == (0, 1), (slot, state)
    client.change_session(DiagnosticSessionControl.Session.programmingSession)
    client.write_data_by_identifier(0x011A, head + signature)
    download(client, 2, images[struct.unpack(">I", head[25:29])[0]:])
    client.start_routine(0xFF01)
    print("reset", flush=True)
    for _ in range(6000):
        pipes.turn()
    slot, state, *_crc = client.read_data_by_identifier(0x011A).service_data.values[0x011A]
    assert (slot, state) == (0, 3), (slot, state)
    print("the update was rolled back")


def main():
    name = sys.argv[1]
    pipes = Pipes()
    with Client(pipes, config=CONFIG) as client:
        signed = json.loads(Path(name + ".json").read_text())
        write(client, pipes, Path(name).read_bytes(), signed)
        update(client, pipes, Path(name + ".update").read_bytes(), bytes.fromhex(signed["update"]))
    print("done")


if __name__ == "__main__":
    main()
