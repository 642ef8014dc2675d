from collections.abc import Sequence
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

class Coprocessor:
    """A board, run by the rows of a drive with the code of the firmware; a new one for each drive.

    Results are structured arrays, one element for each row that has a place on the 100 Hz grid. A row's result is known
    some rows later, with its delayed rate. Their fields, NaN where a value is not known:

    - `row`: number of the row; `t_s`: its time, s, in steps of 0.1 ms.
    - `gyro`: yaw rate of the gyro; `live`: the corrected rate that is sent at once; `delayed`: the one sent 70 ms later,
      for a heading; `complete`: with the estimates of all windows that hold the row; rad/s, positive to the left.
    - `live_sigma`, `delayed_sigma`: expected error of the mean rate over one second, rad/s, 1 sigma.
    - `yaw`: the sum of the delayed rates since static initialisation, rad, not wrapped.
    - `roll_rate`, `pitch_rate`: rates about x (forward) and y (left) less their biases, rad/s.
    - `status`, `delayed_status`: 0 initialising, 1 ready, 2 degraded, 3 clipped, 4 stuck, 5 silent.
    - `quality`, `delayed_quality`: 0 good, 1 degraded, 2 initialising, 3 unusable. `faults`: bits. `source`: of the rate.
    - `standstill`: 0 unknown, 1 moving, 2 still.
    """

    def __init__(
        self,
        *,
        weights: str | PathLike[str] | None = None,
        configuration: str | None = None,
        calibration: str | PathLike[str] | None = None,
        wheels: Sequence[bool] = (False, False, False, False),
        radius_m: float = 0.289,
        frames: bool = False,
    ) -> None:
        """Makes a board before its first row; ValueError names what cannot be used.

        weights: weight file (.blob), in place of the default model. configuration: JSON as `gyronet device get --json`
        prints it. calibration: file of `gyronet calibrate`. wheels: which of the four are recorded. radius_m: their
        rolling radius. frames: keep the CAN frames that are sent, until `frames` takes them.
        """

    def run(
        self,
        t_s: ArrayLike,
        imu: ArrayLike,
        wheels: ArrayLike | None = None,
        temp_c: ArrayLike | None = None,
        last: bool = True,
        gnss: ArrayLike | None = None,
    ) -> NDArray[np.void]:
        """Corrects n rows, and with `last` ends the drive: otherwise the newest rows are held back for the next call.

        t_s: (n,) time of the sensor, s, rising, about 10 ms apart. imu: (n, 6) specific force x, y, z, m/s^2, then
        angular rate, rad/s; x forward, y left, z up. wheels: (n, 4) rates of front right, rear right, front left and rear
        left, rad/s. temp_c: (n,) of the sensor. gnss: (n, 5) course over ground, clockwise from north, and its sigma, rad,
        speed, m/s, latitude and longitude, degrees; NaN in rows without, and without sigma. Positions give a course where
        the receiver sends none. ValueError: the drive starts in motion and has no gnss, or a number is out of range.
        """

    def step(
        self,
        t_s: float,
        imu: Sequence[float],
        wheels: Sequence[float] | None = None,
        temp_c: float | None = None,
        gnss: Sequence[float] | None = None,
    ) -> np.void | None:
        """Corrects one row, with the units of `run`; returns the result of the row 12 rows before it, as soon as there is one."""

    def finish(self) -> NDArray[np.void]:
        """Returns the results that are still held back, after the last row."""

    def frames(self) -> list[tuple[float, int, bool, bytes]]:
        """Takes the CAN frames sent since the last call: time, s, identifier, whether it has 29 bits, data."""

    @property
    def gyro_bias(self) -> list[float] | None:
        """Bias of the gyro about x, y, z, rad/s; None during static initialisation."""
