"""Attacks with gradients on drives: patches are optimised on frames of drives, and the drives are made anew in rounds.

A round drives the situations with the current patches, draws frames of these drives by their weight, renders them with
probes, and optimises the patches on them for a number of steps. So the patches are optimised at the poses to which they
lead the car, as in attacks on sequences (Dirty Road Patch, Sato et al., USENIX Security 2021).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes
from safetensors.numpy import save as to_bytes

from gear.collecting.patch_sources import PatchSet, resolve_patch
from gear.compositor.base import CACHE_BYTES, Prepared
from gear.compositor.cache import Cache
from gear.contracts.attacks import Budget, Patch, State, surface_of
from gear.contracts.models import Model
from gear.contracts.tasks import NO_PATCH
from gear.dataset.files import write_whole
from gear.driving.attacked_drives import tried_patch
from gear.driving.drives import DriveRun
from gear.driving.frames import SPLIT, WeightedFrame, drawn_frames, frames_of, write_frames
from gear.driving.severity import severity
from gear.driving.worker import DriveWorker, guard_of_cast
from gear.measuring.patch_checks import is_picture
from gear.plugins.attacks.optimisation.model_group import device_name
from gear.plugins.build import blamed, build
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError
from gear.values.progress import Progress
from gear.values.regular_file import read_regular
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.drives.job import DriveJob
from gear.verbs.attack.models import build_model
from gear.verbs.attack.monitor import Recorder
from gear.verbs.attack.scenes import Scenes

ROUNDS = "rounds"
"""Folder of the frames and patches of the rounds, within the patch folder."""


@dataclass(slots=True, eq=False, kw_only=True)
class RoundMonitor:
    """The monitor of one round: it stops the attack at the end of the round, and saves where the next one begins.

    Attributes:
        recorder: the monitor of the whole attack.
        until: number of steps after which the round ends.
        on_end: called with the patches at the end of the round, before its checkpoint is written.
    """

    recorder: Recorder
    until: int
    on_end: Callable[[tuple[Patch, ...]], None]

    def resume(self) -> State | None:
        """The state at the end of the round before, or within this one; None at the start."""
        return self.recorder.resume()

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Records a step; see `gear.contracts.attacks.Monitor`.

        Args:
            done: number of finished steps.
            values: values of this step by name.
            patches: function that returns the current patches.
            state: function that returns the arrays from which the attack can continue.

        Returns:
            Whether the round has ended.
        """
        is_stopped = self.recorder.step(done, values, patches, state)
        if done < self.until:
            return is_stopped
        self.on_end(patches())
        self.recorder.save(done, state())
        return True


@dataclass(slots=True, eq=False, kw_only=True)
class Rounds:
    """All rounds of an attack with gradients.

    Attributes:
        job: the inputs of the attack.
        worker: the open place and the driver's network.
        runs: the drives.
        recorder: the monitor of the whole attack.
        on_progress: called with finished and all frames while a round's frames are rendered.
    """

    job: DriveJob
    worker: DriveWorker
    runs: Sequence[DriveRun]
    recorder: Recorder
    on_progress: Progress

    def optimised(self) -> tuple[Patch, ...]:
        """The patches after the last round.

        Raises:
            GearError: a drive or a frame cannot be made, or the attack failed.
        """
        request = self.job.request
        self.recorder.resume()  # tells how many steps an interrupted run has done
        first = self.recorder.done // request.redrive
        cast = self.job.drives.casts[self.job.label]
        assert cast.model is not None, "attacks with gradients need a network"
        model = build_model([cast.model], guard_of_cast(cast, self.worker.callbacks), request.seed)
        patches: tuple[Patch, ...] = ()
        for number in range(first, -(-self._steps // request.redrive)):
            scenes = self._scenes(number, device_name(model))
            patches = self._round(number, model, scenes)
        return patches or self._kept(first)

    @property
    def _steps(self) -> int:
        return self.job.request.steps

    def _round(self, number: int, model: Model, scenes: Scenes) -> tuple[Patch, ...]:
        job = self.job
        monitor = RoundMonitor(
            recorder=self.recorder,
            until=min(self._steps, (number + 1) * job.request.redrive),
            on_end=lambda patches: self._keep(number + 1, patches),
        )
        with blamed(job.found, "optimise"):
            patches: tuple[Patch, ...] = build(job.found, job.options).optimise(
                model,
                scenes.samples,
                scenes.compositor,
                budget=Budget(steps=self._steps, queries=None),
                rng=derive_rng(job.request.seed, "attack", job.spec.name),
                monitor=monitor,
            )
        return patches

    def _scenes(self, number: int, device: str) -> Scenes:
        """The frames of a round; they are made unless an earlier run has finished them."""
        root = self._folder(number)
        if not _is_finished(root):
            self._collect(number, root)
        datasets = [open_dataset(root, split=SPLIT)]
        return Scenes(datasets, "transport", device, Cache[Prepared](CACHE_BYTES))

    def _collect(self, number: int, root: Path) -> None:
        request, shown = self.job.request, self._shown(number)
        frames: list[WeightedFrame] = []
        severities = []
        for run in self.runs:
            found, log = frames_of(self.worker, run, shown)
            frames += found
            severities.append(severity(log))
        records = drawn_frames(frames, request.frames, derive_rng(request.seed, "frames", number))
        origin: Json = {
            "runs": [self.job.drives.identity(run, shown) for run in self.runs],
            "frames": [[record.seed, record.index] for record in records],
            "severities": severities,
        }
        write_frames(self.worker, self.runs[0], records, root, origin, self.on_progress)

    def _shown(self, number: int) -> PatchSet:
        """The patches with which the drives of a round are made; none in the first round."""
        if number == 0:
            return resolve_patch(NO_PATCH, surfaces=self.job.surfaces, seed=0)
        return tried_patch([patch.rgb for patch in self._kept(number)])

    def _folder(self, number: int) -> Path:
        return Path(self.job.request.out).absolute() / ROUNDS / f"frames_{number}"

    def _keep(self, number: int, patches: tuple[Patch, ...]) -> None:
        arrays = {patch.name: np.ascontiguousarray(patch.rgb, np.float32) for patch in patches}
        write_whole(Path(self.job.request.out), f"{ROUNDS}/patches_{number}.safetensors", to_bytes(arrays))

    def _kept(self, number: int) -> tuple[Patch, ...]:
        """The patches with which a round begins.

        Raises:
            DatasetError: the file is missing or damaged.
        """
        path = Path(self.job.request.out) / ROUNDS / f"patches_{number}.safetensors"
        try:
            arrays = from_bytes(read_regular(path))
        except (OSError, SafetensorError) as error:
            raise DatasetError(path, "is missing or damaged; start anew with --force") from error
        if not arrays or not all(map(is_picture, arrays.values())):
            raise DatasetError(path, "holds no patches; start anew with --force")
        return tuple(Patch(name=name, rgb=arrays[name]) for name in sorted(arrays, key=surface_of))


def _is_finished(root: Path) -> bool:
    """Whether the frames of a round are a finished dataset."""
    try:
        open_dataset(root, split=SPLIT)
    except DatasetError:
        return False
    return True
