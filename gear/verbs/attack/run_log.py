"""Logs an attack (`--log-to`): its curves, the patches as they develop, and predictions with these patches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch

from gear.contracts.attacks import Patch
from gear.contracts.models import Model
from gear.contracts.tasks import Sample, Task
from gear.measuring.run_log import RunLog
from gear.measuring.sample_figures import ShownPictures, ShownSample, sample_figure
from gear.networks.runtime import as_bytes, seeded
from gear.plugins.attacks.optimisation.model_group import Defended, members_of
from gear.values.frames import UInt8Image
from gear.values.serial import Json
from gear.verbs.attack.curve_titles import HELD_OUT, curve_title
from gear.verbs.attack.outputs import as_picture
from gear.verbs.attack.scenes import Scenes

FIGURE = "samples (far from the ground truth is better for the attack)"
"""Name of the figure of samples."""

SAMPLES = 2
"""Number of samples in a figure."""


class AttackLog:
    """The log of an attack."""

    def __init__(
        self, log: RunLog, *, config: Json, every: int, network: Model, scenes: Scenes, task: Task[Any, Any]
    ) -> None:
        """Prepares the log.

        Args:
            log: the log of the run.
            config: all inputs of the attack, as JSON.
            every: number of steps between two figures; the first step has a figure, too.
            network: the attacked model, with its defense.
            scenes: samples of the figures: the validation samples if there are any.
            task: task of the samples.
        """
        self._log, self._config, self._every = log, config, every
        self._network, self._scenes, self._task = network, scenes, task
        self._clean: CleanSamples = {}
        self._last = -1

    def begin(self, done: int) -> None:
        """Opens the log, if it is not open.

        Args:
            done: number of steps that earlier, interrupted runs have finished.
        """
        self._log.begin(done, self._config)

    def step(self, done: int, values: Mapping[str, float]) -> None:
        """Logs the values of a step.

        Args:
            done: number of finished steps.
            values: values by name, as the attack reports them.
        """
        if self._log.is_on:
            self.begin(done - 1)
            self._log.scalars({f"training/{curve_title(name)}": value for name, value in values.items()}, done)

    def has_figures_at(self, done: int) -> bool:
        """Whether the patches after a step are logged.

        Args:
            done: number of finished steps.
        """
        return self._log.is_on and (done == 1 or done % self._every == 0)

    def validated(self, done: int, objective: float) -> None:
        """Logs the objective on the validation samples.

        Args:
            done: number of finished steps.
            objective: mean objective with the current patches.
        """
        self.begin(done)
        self._log.scalar(f"validation/{curve_title(HELD_OUT)}", objective, done)

    def patches(self, done: int, patches: Sequence[Patch]) -> None:
        """Logs the patches, and predictions without and with them; does nothing if those of this step are logged.

        Args:
            done: number of finished steps.
            patches: one patch per surface.
        """
        if not self._log.is_on or done == self._last:
            return
        self.begin(done)
        self._last = done
        self._log.pictures(done, lambda: {f"patches/{patch.name}": as_picture(patch) for patch in patches})
        self._log.pictures(done, lambda: {FIGURE: self.figure(patches)})

    def finish(self, done: int, patches: Sequence[Patch], achieved: Json) -> None:
        """Logs the resulting patches and their effect against random patches, and closes the log.

        Args:
            done: number of finished steps.
            patches: the patches of the attack.
            achieved: by the name of a group of samples, the objective with random patches and with these.
        """
        self._last = -1
        self.patches(done, patches)
        for group, found in (achieved or {}).items():
            for name in ("random", "patch") if found else ():
                value = float("nan") if found[name] is None else found[name]
                self._log.scalar(f"result/{curve_title(f'objective, {group} samples, {name}')}", value, done)
        self._log.close()

    def flush(self) -> None:
        """Makes the logger store all entries; called before a checkpoint is written."""
        self._log.flush()

    def figure(self, patches: Sequence[Patch]) -> UInt8Image:
        """Draws the samples without and with patches, with predictions and ground truth.

        Args:
            patches: one patch per surface.

        Returns:
            (H, W, 3) uint8 RGB.
        """
        return figure_of(self._task, self._network, self._scenes, patches, self._clean)


CleanSamples = dict[int, tuple[Sample, ShownPictures]]
"""Samples with their predictions without patches, by index."""


def figure_of(
    task: Task[Any, Any],
    network: Model,
    scenes: Scenes,
    patches: Sequence[Patch],
    clean: CleanSamples | None = None,
) -> UInt8Image:
    """Draws the samples in which the patches are largest, without and with the patches: pictures, predictions of the
    attacked models behind their defense, and ground truth.

    The random generators of torch have the same state afterwards.

    Args:
        task: task of the samples.
        network: the attacked model, with its defense.
        scenes: the samples, with the compositor that puts patches into them.
        patches: one patch per surface.
        clean: predictions without patches, which the first call adds and later calls use; None for a single call.

    Returns:
        (H, W, 3) uint8 RGB.
    """
    clean = {} if clean is None else clean
    tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
    with seeded(0), torch.no_grad():
        if not clean:
            for index in _largest(scenes):
                sample = scenes.samples[index]
                predictions = _predictions(network, sample.images)
                clean[index] = (
                    sample,
                    ShownPictures(caption="without the patch", images=sample.images, predictions=predictions),
                )
        found: list[ShownSample] = []
        for index, (sample, without) in clean.items():
            composed = {view: scenes.compositor.compose(tensors, [index], view)[0] for view in sample.images}
            images = {view: as_bytes(picture) for view, picture in composed.items()}
            shown = ShownPictures(caption="with the patch", images=images, predictions=_predictions(network, images))
            found.append((sample, (without, shown)))
    return sample_figure(task, found)


def _largest(scenes: Scenes) -> list[int]:
    """Returns the indices of the samples in which the patch surfaces cover most pixels, in order of the samples."""
    sizes = [sum(one.visible_px for one in sample.surfaces) for sample in scenes.samples]
    return sorted(np.argsort(sizes, kind="stable")[::-1][:SAMPLES].tolist())


def _predictions(network: Model, views: Mapping[str, UInt8Image]) -> dict[str, Any]:
    """Returns the predictions of all attacked models, each behind its defense, by the model's name."""
    found = {}
    for name, member in members_of(network).items():
        if isinstance(member, Defended):
            given = {
                view: torch.from_numpy(picture.copy()).permute(2, 0, 1)[None].to(member.device) / 255
                for view, picture in views.items()
            }
            seen = {view: as_bytes(batch[0]) for view, batch in member.defended(given).views.items()}
            found[name.rstrip("/")] = member.model.predict(seen)
        else:
            found[name.rstrip("/")] = member.predict(views)
    return found
