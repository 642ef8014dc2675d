"""CSV ENDS CORRECTION SCALE ALPHA: what the trainer makes of a drive, as JSON; numpy is all it needs."""

import json
import sys
from pathlib import Path

import numpy as np

from gyronet_train.fognet_loss import fognet_losses
from gyronet_train.recordings import STATIC_SAMPLES, load_drive, windows
from gyronet_train.seconds import FOG, STEPS, load_grid, window_rows

csv = Path(sys.argv[1])
ends = [int(end) for end in sys.argv[2].split(",")]
correction, scale, alpha = map(float, sys.argv[3:])
[drive] = load_grid(csv)
rows = [window_rows(end, "repeat") for end in ends]
full = [window for window, end in zip(rows, ends) if end >= STEPS]
label = np.array([(drive.features[window, FOG] - drive.turn[window]).sum() for window in full])
fog = np.array([drive.features[window, FOG] for window in full])
# The last window's spread stands for that of a training set.
fog = fog / np.sqrt((fog[-1] ** 2).mean())
losses = fognet_losses(np.full(len(full), correction), label, np.zeros_like(fog), fog, scale, alpha)
made = {
    "windows": [drive.features[window].tolist() for window in rows],
    "losses": [float(loss) for loss in losses],
    "window": windows(load_drive(csv).features)[STATIC_SAMPLES].tolist(),
}
json.dump(made, sys.stdout)
