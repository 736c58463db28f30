"""Logs a training (`--log-to`): losses, learning rate, metrics, and predictions on validation samples. The figure of
the finished training is also written without a log.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch

from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Task
from gear.dataset.files import write_whole
from gear.measuring.run_log import RunLog
from gear.measuring.sample_figures import ShownPictures, ShownSample, sample_figure
from gear.networks.runtime import as_bytes, seeded
from gear.reporting.directions import metric_direction, with_direction
from gear.values.frames import UInt8Image
from gear.values.serial import Json
from gear.verbs.train.adversary import Adversary
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.validate import LOSS

SAMPLES = 3
"""Number of validation samples in a figure."""

FIGURE = "validation samples (close to the ground truth is better)"
"""Name of the figure of samples."""

SAMPLES_FILE, QUALITY = "samples.jpg", 92
"""Name of the figure of the finished training in its folder, and its JPEG quality."""


def metric_title(name: str, spec: TaskSpec[Any], task: Task[Any, Any]) -> str:
    """Returns the name of a validation metric with its direction, such as `miou (up is better)`.

    Args:
        name: name of the metric, or `loss`.
        spec, task: spec of the task, and the task, which state the directions of their metrics.
    """
    return with_direction(name, lower_is_better=True if name == LOSS else metric_direction(name, spec, task))


class TrainLog:
    """The log of a training."""

    def __init__(self, log: RunLog, config: Json, spec: TaskSpec[Any], task: Task[Any, Any]) -> None:
        """Prepares the log.

        Args:
            log: the log of the run.
            config: everything on which the weights depend, as JSON.
            spec, task: spec of the task, and the task.
        """
        self._log, self._config, self._spec, self._task = log, config, spec, task

    def begin(self, state: TrainingState) -> None:
        """Opens the log.

        Args:
            state: state of the training, new or from a checkpoint.
        """
        self._log.begin(state.step, self._config)

    def noted(self, state: TrainingState) -> None:
        """Logs mean loss and learning rate of the last steps, which are the last entry of the history.

        Args:
            state: state of the training.
        """
        point = state.steps[-1]
        self._log.scalar(f"training/{with_direction(LOSS, lower_is_better=True)}", point["loss"], state.step)
        self._log.scalar("training/learning rate", point["rate"], state.step)

    def validated(
        self,
        state: TrainingState,
        metrics: dict[str, float],
        network: Any,
        views: Sequence[str],
        samples: Sequence[Any],
    ) -> None:
        """Logs the metrics of a validation, and predictions on some of its samples.

        Args:
            state: state of the training.
            metrics: metrics by name, with the loss.
            network: the network that was validated.
            views: names of the cameras whose pictures the network uses.
            samples: the validation samples.
        """
        for name, value in metrics.items() if self._log.is_on else ():
            self._log.scalar(f"validation/{metric_title(name, self._spec, self._task)}", value, state.step)
        self._log.pictures(state.step, lambda: {FIGURE: figure_of(self._task, network, views, samples)})

    def patches(self, state: TrainingState, adversary: Adversary) -> None:
        """Logs the newest patches of an adversarial training.

        Args:
            state: state of the training.
            adversary: the pool of patches.
        """

        def newest() -> dict[str, UInt8Image]:
            pool = adversary.state()
            last = max(pool).partition(".")[0]
            shown = {key.partition(".")[2]: patch for key, patch in pool.items() if key.partition(".")[0] == last}
            return {f"patches/patch_{int(number)}": as_bytes(patch) for number, patch in shown.items()}

        self._log.pictures(state.step, newest)

    def flush(self) -> None:
        """Makes the logger store all entries; called before a checkpoint is written."""
        self._log.flush()


def write_samples(root: Path, task: Task[Any, Any], network: Any, views: Sequence[str], samples: Sequence[Any]) -> None:
    """Writes `samples.jpg`: validation samples with predictions and ground truth. It depends only on its arguments.

    Args:
        root: folder of the training.
        task, network, views, samples: those of `figure_of`.

    Raises:
        Exception: whatever the task or the network raises; they may belong to another package.
    """
    figure = figure_of(task, network, views, samples)
    data = cv2.imencode(".jpg", figure[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]
    write_whole(root, SAMPLES_FILE, data.tobytes())


def figure_of(task: Task[Any, Any], network: Any, views: Sequence[str], samples: Sequence[Any]) -> UInt8Image:
    """Draws some samples: picture, prediction and ground truth.

    The random generators of torch have the same state afterwards.

    Args:
        task: task of the samples.
        network: the network, in eval mode.
        views: names of the cameras whose pictures the network uses.
        samples: samples, of which some are drawn, evenly spaced.

    Returns:
        (H, W, 3) uint8 RGB.
    """
    rows: list[ShownSample] = []
    with seeded(0), torch.no_grad():
        for index in np.unique(np.linspace(0, len(samples) - 1, SAMPLES).round().astype(int)).tolist():
            sample = samples[index]
            prediction = network.predict({name: sample.images[name] for name in views})
            shown = ShownPictures(caption=sample.record.scene, images=sample.images, predictions={"": prediction})
            rows.append((sample, [shown]))
    return sample_figure(task, rows)
