"""GyroNet of Zhao et al., section III-B: (N, 6) -> 2 x Bi-LSTM(60) -> FC 120->2 per step. The Bi-LSTMs can have fewer
units or be left out, and a linear part over the whole window can be added (linear.py).

The second output is the paper's future work, "learning uncertainty": the log of the scale of a
Laplace error.
"""

import torch
from torch import nn

from .recordings import WINDOW

INPUTS = 6
HIDDEN = 60


class GyroNet(nn.Module):
    """Estimates the yaw gyro's error for each sample of a window, and the uncertainty of the estimate.

    Input (B, N, 6): specific force xyz in m/s^2, then angular rate xyz in rad/s
    less its static mean. Output: gyro error (B, N) in rad/s, and for each window
    (B,) the scale in rad/s of the Laplace error that the mean of the window's
    corrected rates has. Inputs and outputs are scaled inside the network, by
    constants that are stored in the checkpoint.
    """

    steps = WINDOW

    def __init__(
        self,
        input_mean: torch.Tensor,
        input_std: torch.Tensor,
        output_scale: float,
        units: int = HIDDEN,
        linear: torch.Tensor | None = None,
    ):
        """`units` is per direction; `linear` (N, 6 N) holds the fixed weights of the linear part."""
        super().__init__()
        self.register_buffer("input_mean", input_mean.float())
        self.register_buffer("input_std", input_std.float())
        self.register_buffer("output_scale", torch.tensor([output_scale], dtype=torch.float32))
        self.units = units
        self.linear = None
        if linear is not None:
            self.linear = nn.Linear(linear.shape[1], linear.shape[0], bias=False)
            self.linear.weight = nn.Parameter(linear.clone().float(), requires_grad=False)
        if units > 0:
            self.lstm1 = nn.LSTM(INPUTS, units, batch_first=True, bidirectional=True)
            self.lstm2 = nn.LSTM(2 * units, units, batch_first=True, bidirectional=True)
            self.fc = nn.Linear(2 * units, 2)

    def layers(self, x: torch.Tensor) -> dict[str, torch.Tensor]:
        """Returns the output of every layer, by its name in the golden tensors."""
        normalised = (x - self.input_mean) / self.input_std
        outputs = {"normalised": normalised}
        gyro_error, log_scale = x.new_zeros(x.shape[:2]), x.new_zeros(x.shape[:2])
        if self.units > 0:
            outputs["layer1"], _ = self.lstm1(normalised)
            outputs["layer2"], _ = self.lstm2(outputs["layer1"])
            gyro_error, log_scale = self.fc(outputs["layer2"]).unbind(-1)
        gyro_error = gyro_error * self.output_scale
        if self.linear is not None:
            outputs["linear"] = self.linear(x.flatten(1))
            gyro_error = gyro_error + outputs["linear"]
        return {**outputs, "gyro_error": gyro_error, "log_scale": log_scale.mean(1)}

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        outputs = self.layers(x)
        return outputs["gyro_error"], self.output_scale * outputs["log_scale"].exp()
