"""Drives as the samples of an attack: a patch goes in, the severity of the closed-loop drives comes out.

Attacks without gradients (`square`, `nes`, and those of other packages) see drives as they see pictures:
`AttackedDrive` is the sample, `PassThroughCompositor` the compositor, `DriveObjective` the objective. No picture is
composed, because the renderer shows the patch in every frame of the drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gear.collecting.patch_sources import PatchSet, as_printed, digest_of
from gear.contracts.attacks import Objective
from gear.contracts.models import Model
from gear.driving.drives import DriveRun
from gear.driving.severity import severity
from gear.driving.worker import DriveWorker, drive_once
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

TRIED = "tried"
"""Label of the patches that an attack tries."""

NO_NETWORK = "a driver is asked only within its drives; use an attack that asks for the objective alone"


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchSurfaces:
    """What an attack reads of a sample's record.

    Attributes:
        surfaces: names of the patch surfaces of the scene.
    """

    surfaces: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AttackedDrive:
    """One drive as the sample of an attack.

    Attributes:
        run: the drive, with the twin `patch`.
        record: the surfaces that show the patches.
        objective: severity of drives with these patches, the same object for all samples of an attack.
    """

    run: DriveRun
    record: PatchSurfaces
    objective: DriveObjective

    @property
    def images(self) -> Mapping[str, npt.NDArray[np.uint8]]:
        """One empty picture per surface, by name: the views of the sample are the patches themselves."""
        return {name: np.zeros((0, 0, 3), np.uint8) for name in self.record.surfaces}

    def own_objective(self) -> Objective:
        """The objective of all attacks on this sample."""
        return self.objective


@dataclass(frozen=True, slots=True, kw_only=True)
class PassThroughCompositor:
    """The compositor of drives: returns the patch of a surface unchanged, because the renderer shows it.

    Attributes:
        surfaces: names of the patch surfaces, in the order of the patches.
    """

    surfaces: tuple[str, ...]

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """The patch of the surface `view`, once for each sample.

        Args:
            patches: one tensor per surface, values in 0..1: (3, h, w), or (B, 3, h, w) with one patch per sample.
            samples: indices of B samples.
            view: name of the surface.

        Returns:
            (B, 3, h, w) values in 0..1.
        """
        patch = patches[self.surfaces.index(view)]
        return patch if patch.ndim == 4 else patch.expand(len(samples), *patch.shape)


@dataclass(slots=True, eq=False, kw_only=True)
class DriveObjective:
    """The mean severity of drives with the tried patches (`gear.driving.severity`). Drives are made one after another.

    Attributes:
        worker: the open place and the network.
        drives_made: number of drives made so far.
    """

    worker: DriveWorker
    drives_made: int = 0
    _known: dict[tuple[DriveRun, str], float] = field(default_factory=dict)

    @property
    def needs_clean_output(self) -> bool:
        """False: drives without a patch are not needed."""
        return False

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]) -> Tensor:
        """The mean severity of a batch of drives.

        Args:
            model: not used; the driver of each drive has its own network.
            views: (B, 3, h, w) patches in 0..1 by name of the surface.
            samples: the B drives.
            indices: not used.
        """
        import torch

        found = []
        for number, sample in enumerate(samples):
            textures = [view[number].detach().permute(1, 2, 0).cpu().numpy() for view in views.values()]
            found.append(self.severity_of(sample.run, tried_patch(textures)))
        return torch.tensor(sum(found) / len(found), dtype=torch.float64)

    def terms(self, *_: object, **__: object) -> Mapping[str, Any]:
        """No terms: a drive has no gradients.

        Raises:
            TypeError: always.
        """
        raise TypeError(NO_NETWORK)

    def severity_of(self, run: DriveRun, patch: PatchSet) -> float:
        """The severity of one drive; equal drives are made only once.

        Args:
            run: the drive.
            patch: the patch that its scene shows.
        """
        key = (run, patch.digest)
        if key not in self._known:
            self._known[key] = severity(drive_once(self.worker, run, patch).log)
            self.drives_made += 1
        return self._known[key]


def tried_patch(textures: Sequence[npt.NDArray[np.float32]]) -> PatchSet:
    """Textures as the patches of a scene, rounded to 8 bits as a printed patch is.

    Args:
        textures: (h, w, 3) sRGB values in 0..1, one per surface.
    """
    images = [as_printed(one) for one in textures]
    return PatchSet(label=TRIED, images=tuple(images), digest=digest_of(images))


class PlaceholderModel:
    """Stands for the attacked network where an attack expects one: the network of a driver is asked only within its
    drives.
    """

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """Predicts nothing.

        Args:
            views: not used.

        Raises:
            TypeError: always.
        """
        raise TypeError(NO_NETWORK)

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Computes nothing.

        Args:
            views: not used.
            targets: not used.

        Raises:
            TypeError: always.
        """
        raise TypeError(NO_NETWORK)

    def taps(self) -> Mapping[str, Any]:
        """No layers can be read."""
        return {}
