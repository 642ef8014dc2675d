"""The Gaussian processes of lwoi: they predict the error of a second's measurements.

There is an independent process for each component of the error. All share the features that a small
convolutional network extracts from a window. The inducing points are 100 windows, which are optimised
with the other parameters; the cost of exact processes would grow with the cube of the number of
windows. Targets are divided by their RMS in training, but not centred: far from the training data a
process then predicts no correction.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import gpytorch
import numpy as np
import torch
from torch import nn

CHANNELS, FEATURES = 3, 20
INDUCING = 100
START_NOISE = 0.1
NOISE_RATE = 10.0  # learning rate of the noise over the others': in 100 steps of 0.01 it could not leave 0.04 to 0.25
DECAY = 0.999  # of the learning rate per step
CHUNK = 2000  # windows that are predicted at once


class ProcessError(ValueError):
    """A process cannot be trained. The text gives the step or describes the data."""


class Features(nn.Module):
    """Two convolutions and one linear layer, from windows (n, 100 * 3) to 20 features."""

    def __init__(self):
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv1d(CHANNELS, 100, 3, 5),
            nn.ReLU(),
            nn.Conv1d(100, 50, 3, 5),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(200, FEATURES),
        )

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        return self.layers(windows.unflatten(-1, (-1, CHANNELS)).transpose(-1, -2))


class SparseProcess(gpytorch.models.ApproximateGP):
    """Independent sparse processes with Matern 5/2 kernels on common features."""

    def __init__(self, features: nn.Module, inducing: torch.Tensor, outputs: int):
        batch = torch.Size([outputs])
        posterior = gpytorch.variational.CholeskyVariationalDistribution(len(inducing), batch_shape=batch)
        strategy = gpytorch.variational.VariationalStrategy(self, inducing, posterior)
        super().__init__(gpytorch.variational.IndependentMultitaskVariationalStrategy(strategy, outputs))
        self.features = features
        self.mean = gpytorch.means.ZeroMean(batch_shape=batch)
        matern = gpytorch.kernels.MaternKernel(2.5, ard_num_dims=FEATURES, batch_shape=batch)
        self.covariance = gpytorch.kernels.ScaleKernel(matern, batch_shape=batch)
        matern.lengthscale = 1.0
        self.covariance.outputscale = 1.0

    def forward(self, windows: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        seen = self.features(windows)
        return gpytorch.distributions.MultivariateNormal(self.mean(seen), self.covariance(seen))


@dataclass(frozen=True)
class Settings:
    """Settings of a process's training."""

    steps: int = 100
    rate: float = 0.01
    jitter: float = 1e-3
    seed: int = 1


class Trained:
    """A trained process, with mean and standard deviation of its inputs and the scale of its targets."""

    def __init__(self, model, likelihood, units, scale: np.ndarray, settings: Settings, seconds: float):
        self.model, self.likelihood, self.units = model, likelihood, units
        self.scale, self.settings, self.seconds = scale, settings, seconds

    @torch.no_grad()
    def predict(self, windows: np.ndarray) -> np.ndarray:
        """Predicts the errors (n, outputs) of windows (n, 100, 3)."""
        inputs = standardised(windows, *self.units)
        with gpytorch.settings.variational_cholesky_jitter(self.settings.jitter):
            parts = [self.likelihood(self.model(part)) for part in inputs.split(CHUNK)]
            return torch.cat([part.mean for part in parts]).double().numpy() * self.scale


def standardised(windows: np.ndarray, mean: np.ndarray, spread: np.ndarray) -> torch.Tensor:
    """Normalises windows by each channel's mean and standard deviation, and flattens them to (n, 100 * channels)."""
    return torch.from_numpy(((windows - mean) / spread).reshape(len(windows), -1)).float()


def train(
    windows: np.ndarray,
    errors: np.ndarray,
    settings: Settings,
    report: Callable[[int, float], None] = lambda step, loss: None,
) -> Trained:
    """Fits a process to windows (n, 100, 3) and errors (n, outputs); each step of Adam uses all windows."""
    begin = time.monotonic()
    torch.manual_seed(settings.seed)
    units = windows.mean(axis=(0, 1)), windows.std(axis=(0, 1))
    scale = np.sqrt((errors**2).mean(axis=0))
    if not (np.isfinite(scale).all() and (scale > 0).all() and (units[1] > 0).all()):
        raise ProcessError(f"{len(windows)} windows: a channel or an error is constant or not a number")
    inputs, targets = standardised(windows, *units), torch.from_numpy(errors / scale).float()
    chosen = np.linspace(0, len(inputs) - 1, min(INDUCING, len(inputs))).astype(int)
    outputs = errors.shape[1]
    model = SparseProcess(Features(), inputs[chosen].clone(), outputs)
    likelihood = gpytorch.likelihoods.MultitaskGaussianLikelihood(outputs, has_global_noise=False)
    likelihood.task_noises = torch.full((outputs,), START_NOISE)
    bound = gpytorch.mlls.VariationalELBO(likelihood, model, len(inputs))
    parameters = [*model.parameters(), *likelihood.parameters()]
    noise = {"params": likelihood.parameters(), "lr": NOISE_RATE * settings.rate}
    optimiser = torch.optim.Adam([{"params": model.parameters()}, noise], settings.rate)
    schedule = torch.optim.lr_scheduler.ExponentialLR(optimiser, DECAY)
    with gpytorch.settings.variational_cholesky_jitter(settings.jitter):
        for step in range(1, settings.steps + 1):
            optimiser.zero_grad()
            loss = -bound(model(inputs), targets)
            if not torch.isfinite(loss):
                raise ProcessError(f"step {step}: the loss is not a number")
            loss.backward()
            torch.nn.utils.clip_grad_norm_(parameters, 1.0)
            optimiser.step()
            schedule.step()
            report(step, loss.item())
    model.eval()
    likelihood.eval()
    return Trained(model, likelihood, units, scale, settings, time.monotonic() - begin)
