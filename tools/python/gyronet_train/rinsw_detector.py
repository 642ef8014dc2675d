"""The detectors of RINS-W: one recurrent network for each motion profile, from the inertial sensor alone.

Each is an LSTM of two layers and a perceptron of two layers. It gives a probability for every sample
from that sample and earlier ones. Its state is reset every second, and it then runs from three seconds
earlier on. Trained on windows of 4 s, a network that ran through a whole drive found only 2 to 36 % of
the stops.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import nn

from .rinsw_profiles import PROFILES

CHANNELS = 6  # gyro, accelerometer
WINDOW, BLOCK = 400, 100  # samples that a network runs on after a reset, and the last of them, whose outputs are used
CHUNK = 100  # windows that are processed at once
THRESHOLDS = np.array([0.95, 0.95, 0.5, 0.5])  # probabilities above which a profile counts as detected
BIAS = 1e-3  # rad/s and m/s^2: largest bias that training adds to a channel of a window
NOISE = np.repeat([8e-5, 1e-3], 3)  # rad/s, m/s^2: standard deviation of the noise that training adds to a sample


class DetectorError(ValueError):
    """A detector cannot be trained or read. The text describes the data or names the file."""


@dataclass(frozen=True)
class Settings:
    """Size and training of the detectors."""

    units: int = 80
    steps: int = 1200  # of Adam, for each network
    batch: int = 32  # windows of a step
    rate: float = 3e-3  # initial rate; it falls along a cosine
    seed: int = 1


class Network(nn.Module):
    """Returns the logit of one profile for each sample (windows, samples, 6)."""

    def __init__(self, units: int):
        super().__init__()
        self.recurrent = nn.LSTM(CHANNELS, units, num_layers=2, batch_first=True)
        self.head = nn.Sequential(nn.Linear(units, units), nn.ReLU(), nn.Linear(units, 1))

    def forward(self, samples: torch.Tensor) -> torch.Tensor:
        return self.head(self.recurrent(samples)[0])[..., 0]


class Detectors(nn.Module):
    """The four networks, with mean and standard deviation of the samples that they were trained on."""

    def __init__(self, settings: Settings):
        super().__init__()
        self.settings = settings
        self.register_buffer("mean", torch.zeros(CHANNELS, dtype=torch.float64))
        self.register_buffer("spread", torch.ones(CHANNELS, dtype=torch.float64))
        self.networks = nn.ModuleDict({profile: Network(settings.units) for profile in PROFILES})

    def standardised(self, samples: np.ndarray) -> torch.Tensor:
        """Normalises samples (..., 6) by each channel's mean and standard deviation."""
        return ((torch.from_numpy(samples) - self.mean) / self.spread).float()

    @torch.no_grad()
    def probabilities(self, samples: np.ndarray) -> np.ndarray:
        """Returns the probability of each profile at each sample of a drive of whole seconds (steps, 4). The first
        sample is repeated before the drive."""
        before = np.repeat(samples[:1], WINDOW - BLOCK, axis=0)
        inputs = self.standardised(np.concatenate([before, samples])).unfold(0, WINDOW, BLOCK).transpose(1, 2)
        parts = [
            torch.stack([self.networks[profile](part)[:, -BLOCK:] for profile in PROFILES], dim=-1)
            for part in inputs.split(CHUNK)
        ]
        return torch.sigmoid(torch.cat(parts)).reshape(-1, len(PROFILES)).double().numpy()

    def detect(self, samples: np.ndarray) -> np.ndarray:
        """Returns which profiles are detected at each sample of a drive (steps, 4)."""
        return self.probabilities(samples) > THRESHOLDS

    def save(self, path: Path) -> None:
        """Writes the networks and their settings."""
        save_file(self.state_dict(), path, {"settings": json.dumps(asdict(self.settings))})


def load_detectors(path: Path) -> Detectors:
    """Reads the file that `save` wrote. Raises DetectorError with the file's name."""
    try:
        with safe_open(path, framework="pt") as file:
            settings = Settings(**json.loads((file.metadata() or {})["settings"]))
            detectors = Detectors(settings)
            detectors.load_state_dict({name: file.get_tensor(name) for name in file.keys()})
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise DetectorError(f"{path}: not a file of RINS-W detectors: {error}") from error
    return detectors


def train(
    drives: list[np.ndarray],
    labels: list[np.ndarray],
    settings: Settings,
    report: Callable[[str, int, float], None] = lambda profile, step, loss: None,
) -> tuple[Detectors, dict[str, float]]:
    """Trains on drives of samples (steps, 6) and their labels (steps, 4); also returns the time of each profile, s."""
    samples = np.concatenate(drives)
    if min(map(len, drives)) < WINDOW:
        raise DetectorError(f"a drive of {min(map(len, drives))} samples: training needs at least {WINDOW}")
    if not np.isfinite(samples).all() or (samples.std(axis=0) == 0).any():
        raise DetectorError(f"{len(samples)} samples: a channel is constant or not a number")
    torch.manual_seed(settings.seed)
    detectors = Detectors(settings)
    detectors.mean.copy_(torch.from_numpy(samples.mean(axis=0)))
    detectors.spread.copy_(torch.from_numpy(samples.std(axis=0)))
    seconds = {}
    for k, profile in enumerate(PROFILES):
        begin = time.monotonic()
        targets = [drive_labels[:, k] for drive_labels in labels]
        train_one(detectors, profile, drives, targets, lambda step, loss: report(profile, step, loss))
        seconds[profile] = time.monotonic() - begin
    return detectors.eval(), seconds


def train_one(
    detectors: Detectors,
    profile: str,
    drives: list[np.ndarray],
    targets: list[np.ndarray],
    report: Callable[[int, float], None],
) -> None:
    """Trains the network of one profile with Adam on windows drawn at random."""
    settings, network = detectors.settings, detectors.networks[profile]
    random = np.random.default_rng([settings.seed, PROFILES.index(profile)])
    optimiser = torch.optim.Adam(network.parameters(), settings.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, settings.steps)
    for step in range(1, settings.steps + 1):
        inputs, wanted = windows(drives, targets, settings.batch, random)
        loss = nn.functional.binary_cross_entropy_with_logits(network(detectors.standardised(inputs)), wanted)
        if not torch.isfinite(loss):
            raise DetectorError(f"{profile}, step {step}: the loss is not a number")
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        report(step, loss.item())


def windows(drives: list[np.ndarray], targets: list[np.ndarray], count: int, random: np.random.Generator) -> tuple:
    """Draws random windows (count, WINDOW, 6) and their labels; noise and a bias are added to each window."""
    chosen = random.integers(len(drives), size=count)
    places = [(k, random.integers(len(drives[k]) - WINDOW + 1)) for k in chosen]
    samples = np.stack([drives[k][first : first + WINDOW] for k, first in places])
    wanted = np.stack([targets[k][first : first + WINDOW] for k, first in places])
    bias = random.uniform(-BIAS, BIAS, (count, 1, CHANNELS))
    return samples + bias + NOISE * random.normal(size=samples.shape), torch.from_numpy(wanted).float()
