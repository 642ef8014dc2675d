"""FoGNet of Zhao et al., section III-C, with N = 60 one-second steps."""

import torch
from torch import nn

from .seconds import FOG, STEPS

INPUTS = 9
HIDDEN1 = 90
HIDDEN2 = STEPS
PARAMETERS = 387_006


class FoGNet(nn.Module):
    """Estimates the error of a gyro over a window of a minute.

    Input (B, 60, 9), one row per second: mean specific force xyz in m/s^2, mean angular rate xyz in
    rad/s less its static mean, distance of the left and the right wheel in m, gyro increment in rad.
    Output (B): the correction in rad, gyro less truth over the window.

    The paper predicts the turn itself and subtracts the gyro's sum. Here the last layer gives the
    difference directly, in units of `correction_scale`, so FC3 holds the difference from the plain
    sum. The functions and parameters are the same, but a correction of 1e-4 rad is not the
    difference of two numbers near 1. FC2 and FC3 begin at zero, so the first prediction is the plain
    sum.
    """

    steps = STEPS

    def __init__(self, input_mean: torch.Tensor, input_std: torch.Tensor, correction_scale: float):
        super().__init__()
        self.register_buffer("input_mean", input_mean.float())
        self.register_buffer("input_std", input_std.float())
        self.register_buffer("correction_scale", torch.tensor([correction_scale], dtype=torch.float32))
        self.lstm1 = nn.LSTM(INPUTS, HIDDEN1, num_layers=2, batch_first=True, bidirectional=True)
        self.fc1 = nn.Linear(2 * HIDDEN1, 1)
        self.lstm2 = nn.LSTM(2, HIDDEN2, num_layers=2, batch_first=True, bidirectional=True)
        self.fc2 = nn.Linear(2 * HIDDEN2, 1)
        self.fc3 = nn.Linear(STEPS, 1)
        self.fc4 = nn.Linear(2, 1)
        for layer in (self.fc2, self.fc3):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        nn.init.ones_(self.fc4.weight)
        nn.init.zeros_(self.fc4.bias)
        assert sum(p.numel() for p in self.parameters()) == PARAMETERS

    def layers(self, x: torch.Tensor) -> dict[str, torch.Tensor]:
        """Returns the output of every layer, by its name in the golden tensors."""
        normalised = (x - self.input_mean) / self.input_std
        layer1, _ = self.lstm1(normalised)
        f1 = self.fc1(layer1)
        fog = normalised[..., FOG : FOG + 1]
        layer2, _ = self.lstm2(torch.cat([f1, fog], dim=-1))
        f2 = self.fc2(layer2[:, -1])
        f3 = self.fc3(fog.squeeze(-1))
        correction = self.fc4(torch.cat([f2, f3], dim=-1)) * self.correction_scale
        return {
            "normalised": normalised,
            "f1": f1.squeeze(-1),
            "layer2_last": layer2[:, -1],
            "f2": f2.squeeze(-1),
            "f3": f3.squeeze(-1),
            "correction": correction.squeeze(-1),
            "prediction": x[..., FOG].sum(dim=-1) - correction.squeeze(-1),
        }

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns the correction (rad), f1, and the gyro increments that f1 should approximate (both normalised)."""
        outputs = self.layers(x)
        return outputs["correction"], outputs["f1"], outputs["normalised"][..., FOG]
