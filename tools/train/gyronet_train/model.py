"""GyroNet of Zhao et al., section III-B: (N, 6) -> 2 x Bi-LSTM(60) -> FC 120->2 per step.

The second output is the paper's future work, "learning uncertainty": the log of the scale of a
Laplace error.
"""

from __future__ import annotations

import torch
from torch import nn

from .recordings import WINDOW

INPUTS = 6
HIDDEN = 60


class GyroNet(nn.Module):
    """Estimates the yaw gyro's error for each sample of a window, and how far off it may be.

    Input (B, N, 6): specific force xyz in m/s^2, then angular rate xyz in rad/s
    less its static mean. Output: gyro error (B, N) in rad/s, and for each window
    (B,) the scale in rad/s of the Laplace error that the mean of the window's
    corrected rates has. All ends are scaled inside, by constants that travel with
    the checkpoint.
    """

    steps = WINDOW

    def __init__(self, input_mean: torch.Tensor, input_std: torch.Tensor, output_scale: float):
        super().__init__()
        self.register_buffer("input_mean", input_mean.float())
        self.register_buffer("input_std", input_std.float())
        self.register_buffer("output_scale", torch.tensor([output_scale], dtype=torch.float32))
        self.lstm1 = nn.LSTM(INPUTS, HIDDEN, batch_first=True, bidirectional=True)
        self.lstm2 = nn.LSTM(2 * HIDDEN, HIDDEN, batch_first=True, bidirectional=True)
        self.fc = nn.Linear(2 * HIDDEN, 2)

    def layers(self, x: torch.Tensor) -> dict[str, torch.Tensor]:
        """Every layer's output, by the names the golden tensors carry."""
        normalised = (x - self.input_mean) / self.input_std
        layer1, _ = self.lstm1(normalised)
        layer2, _ = self.lstm2(layer1)
        gyro_error, log_scale = self.fc(layer2).unbind(-1)
        return {
            "normalised": normalised,
            "layer1": layer1,
            "layer2": layer2,
            "gyro_error": gyro_error * self.output_scale,
            "log_scale": log_scale.mean(1),
        }

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        outputs = self.layers(x)
        return outputs["gyro_error"], self.output_scale * outputs["log_scale"].exp()


def overlap_mean(outputs: torch.Tensor, hop: int, length: int) -> torch.Tensor:
    """Mean of all estimates each sample gets from windows `hop` apart; 0 where none covers it.

    `outputs` is (W, N) for the windows that start at 0, hop, 2 hop, ...; the result is (length,).
    """
    total = torch.zeros(length)
    count = torch.zeros(length)
    starts = torch.arange(outputs.shape[0]) * hop
    for k in range(outputs.shape[1]):
        total.index_add_(0, starts + k, outputs[:, k])
        count.index_add_(0, starts + k, torch.ones(outputs.shape[0]))
    return total / count.clamp(min=1)
