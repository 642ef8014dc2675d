"""GyroNet of Zhao et al., section III-B: (N, 6) -> 2 x Bi-LSTM(60) -> FC 120->1 per step."""

import torch
from torch import nn

from .recordings import WINDOW

INPUTS = 6
HIDDEN = 60


class GyroNet(nn.Module):
    """Estimates the yaw gyro's error for each sample of a window.

    Input (B, N, 6): specific force xyz in m/s^2, then angular rate xyz in rad/s
    less its static mean. Output: gyro error (B, N) in rad/s. Inputs and outputs
    are scaled inside the network, by constants that are stored in the checkpoint.
    """

    steps = WINDOW

    def __init__(self, input_mean: torch.Tensor, input_std: torch.Tensor, output_scale: float):
        super().__init__()
        self.register_buffer("input_mean", input_mean.float())
        self.register_buffer("input_std", input_std.float())
        self.register_buffer("output_scale", torch.tensor([output_scale], dtype=torch.float32))
        self.lstm1 = nn.LSTM(INPUTS, HIDDEN, batch_first=True, bidirectional=True)
        self.lstm2 = nn.LSTM(2 * HIDDEN, HIDDEN, batch_first=True, bidirectional=True)
        self.fc = nn.Linear(2 * HIDDEN, 1)

    def layers(self, x: torch.Tensor) -> dict[str, torch.Tensor]:
        """Returns the output of every layer, by its name in the golden tensors."""
        normalised = (x - self.input_mean) / self.input_std
        layer1, _ = self.lstm1(normalised)
        layer2, _ = self.lstm2(layer1)
        gyro_error = self.fc(layer2).squeeze(-1) * self.output_scale
        return {"normalised": normalised, "layer1": layer1, "layer2": layer2, "gyro_error": gyro_error}

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.layers(x)["gyro_error"]
