"""The task protocol: a rig, a ground truth, files and back, a metric."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar

from gear.values.frames import Frame, UInt8Image
from gear.values.ground_truth import SurfaceTruth
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sample:
    """What every task's sample has; tasks add their own fields.

    Attributes:
        record: the scene, in full.
        images: by camera name, (H, W, 3) uint8, RGB in sRGB, row 0 at the top.
        surfaces: each surface in each view.
    """

    record: SceneRecord
    images: Mapping[str, UInt8Image]
    surfaces: tuple[SurfaceTruth, ...]


SampleT = TypeVar("SampleT", bound=Sample)
PredictionT = TypeVar("PredictionT")
SampleT_contra = TypeVar("SampleT_contra", bound=Sample, contravariant=True)
PredictionT_contra = TypeVar("PredictionT_contra", contravariant=True)

NO_PATCH, RANDOM_PATCH = "none", "random"
CONTROLS = (NO_PATCH, RANDOM_PATCH)
"""Labels of patches that others are compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitInfo:
    """The split that a sample belongs to.

    Attributes:
        town, scene, split: names.
        seed: of the split.
        patch_label: `none`, `random`, or the patch's name and hash.
        created: date of the dataset's format text (ISO, fixed by the config, never the clock).
    """

    town: str
    scene: str
    split: str
    seed: int
    patch_label: str
    created: str = "2022-01-01"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Encoded:
    """A sample as files.

    Attributes:
        files: bytes by path relative to the dataset's root, `/` between folders.
        facts: what of the sample goes into the sidecar, so that `decode` and `finalise` need no second computation;
            JSON.
    """

    files: Mapping[str, bytes]
    facts: Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Auxiliary:
    """A file that a sample owns beside its task's, such as a probe.

    Attributes:
        path: relative to the dataset's root; its hash is among the sidecar's `files`.
        facts: what is needed to read it; JSON.
    """

    path: str
    facts: Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sidecar:
    """What is kept beside each sample: `gear/<split>/samples/<index>.json`.

    Attributes:
        record: the scene.
        surfaces: measured surfaces.
        facts: the task's own.
        files: sha256 by relative path.
        auxiliary: further files by name; empty unless they were asked for.
    """

    record: SceneRecord
    surfaces: tuple[SurfaceTruth, ...]
    facts: Json
    files: Mapping[str, str]
    auxiliary: Mapping[str, Auxiliary] = field(default_factory=dict)


class Evaluator(Protocol[SampleT_contra, PredictionT_contra]):
    """A metric over a data set, gathered sample by sample."""

    def update(self, sample: SampleT_contra, prediction: PredictionT_contra) -> Mapping[str, float]:
        """Takes one sample in; returns its own metrics where the metric has any for a single sample."""
        ...

    def merge(self, other: Any) -> None:
        """Takes in what another evaluator of the same kind has gathered."""
        ...

    def result(self) -> Mapping[str, float]:
        """The metrics over everything gathered; NaN where nothing counts."""
        ...


class Task(Protocol[SampleT, PredictionT]):
    """A dataset format with its ground truth. Holds options only, no state between calls.

    `encode` and `finalise` are pure: they return bytes, and the dataset room writes them atomically, hashes and
    resumes.
    """

    def rig(self) -> Rig:
        """The cameras, on the ego car."""
        ...

    def ground_truth(self, frame: Frame, record: SceneRecord) -> SampleT:
        """Measures one frame."""
        ...

    def encode(self, sample: SampleT, info: SplitInfo) -> Encoded:
        """The sample's own files."""
        ...

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """The split's index files, by path relative to the root, from the sidecars in order of index."""
        ...

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> SampleT:
        """Reads one sample back from its files; the inverse of `encode`."""
        ...

    def as_prediction(self, sample: SampleT) -> PredictionT:
        """The ground truth as a perfect prediction, so that every evaluator can be held against itself."""
        ...

    def evaluator(self) -> Evaluator[SampleT, PredictionT]:
        """A fresh metric."""
        ...

    def preview(self, sample: SampleT) -> Mapping[str, UInt8Image]:
        """Pictures a person would look at, by name.

        The image with its labels, boxes, depth drawn in; (H, W, 3) uint8 each.
        """
        ...
