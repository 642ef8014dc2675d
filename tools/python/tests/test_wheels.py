"""Wheel settings from DBC files."""

import json
import tomllib

import made

REAR = ["--rear-left", "RL", "--rear-right", "RR"]
REFUSED = [
    (dict(length=24), "24 bytes (CAN FD)"),
    (dict(unit="knots"), 'the unit "knots" is not km/h, m/s or mph'),
    (dict(signals=[' SG_ M M : 0|4@1+ (1,0) [0|9] "" E', ' SG_ RL m1 : 8|16@1+ (0.01,0) [0|9] "km/h" E', ' SG_ RR : 24|16@1+ (0.01,0) [0|9] "km/h" E']), "is multiplexed"),
    (dict(signals=[' SG_ RL : 0|32@1- (1,0) [0|9] "km/h" E', ' SG_ RR : 32|16@1+ (0.01,0) [0|9] "km/h" E'], extra="SIG_VALTYPE_ 1200 RL : 1;\n"), "floating-point"),
    (dict(signals=[' SG_ RL : 0|40@1+ (1,0) [0|9] "km/h" E', ' SG_ RR : 40|16@1+ (0.01,0) [0|9] "km/h" E']), "40 bits"),
    (dict(signals=[' SG_ RR : 40|16@1+ (0.01,0) [0|9] "km/h" E']), "no signal RL; there are WHEELS.RR"),
]


class FromDbc(made.Case):
    def run_(self, *arguments, **more):
        made.dbc(self.folder / "car.dbc", **more)
        status, text = made.run(self.folder, "wheels", "from-dbc", "car.dbc", *arguments)
        out = self.folder / "w.toml"
        return status, text, tomllib.loads(out.read_text()) if out.exists() else None

    def test_signs_orders_units_and_codes(self):
        signals = [' SG_ RL : 7|15@0- (0.01,-100) [0|9] "m/s" E', ' SG_ RR : 23|15@0- (0.01,-100) [0|9] "m/s" E', ' SG_ RL_Valid : 40|1@1+ (1,0) [0|1] "" E',
                   ' SG_ RR_Direction : 41|2@1+ (1,0) [0|3] "" E', ' SG_ RR_Quality : 48|2@1+ (1,0) [0|3] "" E', ' SG_ Crc : 56|8@1+ (1,0) [0|1] "" E']
        extra = 'VAL_ 2566844926 RL 16382 "Init" 16383 "Fehler" 0 "stands" ;\nVAL_ 2566844926 RR -16384 "SNA" ;\n'
        extra += 'VAL_ 2566844926 RR_Direction 1 "forward" 2 "backward" ;\n'
        status, text, file = self.run_(*REAR, "--out", "w.toml", identifier=2566844926, signals=signals, extra=extra)
        self.assertEqual(status, 0, text)
        frame = file["frame"][0]
        self.assertEqual((len(file["frame"]), frame["id"], frame["extended"]), (1, 0x18FEF1FE, True))
        left, right = frame["signal"]
        self.assertEqual(left, {"wheel": "rear-left", "start_bit": 7, "bits": 15, "order": "motorola", "signed": True, "factor_kmh": 0.036,
                                "offset_kmh": -360.0, "invalid": [16383, 16382],
                                "valid_when": {"start_bit": 40, "bits": 1, "order": "intel", "value": 1}})
        self.assertEqual(right["reverse_when"], {"start_bit": 41, "bits": 2, "order": "intel", "value": 2})
        self.assertEqual(right["invalid"], 0x4000)
        for words in ("RR_Quality (bit 48, 2 bits) seems to be validity", "a checksum or a counter", "address FE stands for any sender", "its range, 0 to 9, is not used"):
            self.assertIn(words, text)

    def test_what_a_frame_says_of_its_speeds(self):
        signals = [' SG_ RL : 6|15@0+ (0.01,-67.67) [0|250] "km/h" E', ' SG_ RR : 22|15@0+ (0.01,-67.67) [0|250] "km/h" E',
                   ' SG_ RL_FAULT : 7|1@0+ (1,0) [0|1] "" E', ' SG_ RRValidity : 23|1@0+ (1,0) [0|1] "" E']
        codes = " ".join(f'{raw} "Error{raw - 32760}"' for raw in range(32763, 32768))
        extra = f'VAL_ 1200 RRValidity 0 "Valid" 1 "Invalid" ;\nVAL_ 1200 RL {codes} ;\n'
        status, text, file = self.run_(*REAR, "--out", "w.toml", signals=signals, extra=extra)
        self.assertEqual(status, 0, text)
        left, right = file["frame"][0]["signal"]
        self.assertEqual((left["invalid"], left["valid_when"]["start_bit"], left["valid_when"]["value"]), ([32767, 32766, 32765], 7, 0))
        self.assertEqual((right["valid_when"]["start_bit"], right["valid_when"]["value"]), (23, 0))
        self.assertEqual((left["range_kmh"], right["range_kmh"]), ([-0.005, 250.005], [-0.005, 250.005]))
        self.assertIn("0x7ffb (Error3) is no speed either, but the settings hold 3 codes", text)

    def test_bit_31_that_is_missing(self):
        status, text, file = self.run_(*REAR, "--out", "w.toml", identifier=0x10630040)
        self.assertEqual((status, file["frame"][0]["id"], file["frame"][0]["extended"]), (0, 0x10630040, True), text)

    def test_units_of_real_files_and_by_flag(self):
        for unit, factor in (("Unit_KiloMeterPerHour", 0.01), ("Unit_KilometerPerHour", 0.01), ("km^h", 0.01), ("Unit_MeterPerSecond", 0.036)):
            status, text, file = self.run_(*REAR, "--out", "w.toml", unit=unit)
            self.assertEqual((status, file["frame"][0]["signal"][0]["factor_kmh"]), (0, factor), text)
        status, text, file = self.run_(*REAR, "--unit", "RL=m/s", "--unit", "WHEELS.RR=m/s", "--out", "w.toml", unit="")
        self.assertEqual((status, file["frame"][0]["signal"][1]["factor_kmh"]), (0, 0.036), text)
        self.assertIn("no channel or column of that name", self.run_(*REAR, "--unit", "XY=m/s")[1])

    def test_statements_that_cantools_cannot_read_are_left_out(self):
        extra = ('BO_ 1275 2017_5: 8 XXX\n SG_ A : 0|8@1+ (1,0) [0|1] "" X\nBO_ 1276 X1: 8 XXX\n SG_ 0_COUNTER : 0|8@1+ (1,0) [0|1] "" X\n'
                 'CM_ SG_ 304 "Seems to be platform";\nVAL_ 501 CRUISE_STATE 1 "a" ;\nVAL_ 1200 GONE 1 "a" ;\nVAL_ 1200 RL 65535 "SNA" ;\n')
        status, text, file = self.run_(*REAR, "--out", "w.toml", extra=extra)
        self.assertEqual((status, file["frame"][0]["signal"][0]["invalid"]), (0, 0xFFFF), text)
        for words in ("line 10: BO_ 1275 2017_5: 8 XXX", "SG_ 0_COUNTER", "more"):
            self.assertIn(words, text)
        self.assertIn("left out, since cantools cannot read them: line 10", self.run_("--rear-left", "A", "--rear-right", "B", extra=extra)[1])

    def test_what_the_board_cannot_read_is_refused(self):
        for more, words in REFUSED:
            status, text, file = self.run_(*REAR, "--out", "w.toml", **more)
            self.assertEqual((status, file), (1, None), text)
            self.assertIn(words, text)
        self.assertIn("both wheels of an axle", self.run_("--rear-left", "RL", "--out", "w.toml")[1])

    def test_as_json(self):
        status, text, _ = self.run_(*REAR, "--json", unit="Unit_KiloMeterPerHour")
        file = json.loads(text)
        self.assertEqual((status, file["frame"][0]["id"], file["frame"][0]["signal"][0]["range_kmh"], file["remarks"]), (0, 0x4B0, [-0.005, 400.0], []))

    def test_without_signals_they_are_listed_and_nothing_is_written(self):
        status, text, file = self.run_("--out", "w.toml", extra='VAL_ 1200 FL 65535 "SNA" ;\n')
        self.assertEqual((status, file), (1, None))
        for words in ("WHEELS (0x4b0, 8 bytes)", 'WHEELS.FL: 16 bits from 0, x 0.01 +0 "km/h", 65535 "SNA"', "nothing is written"):
            self.assertIn(words, text)
