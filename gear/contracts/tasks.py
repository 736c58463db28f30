"""The protocol of tasks. A task defines the cameras, measures ground truth, converts samples to files and back,
and has a metric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

from gear.values.frames import Frame, UInt8Image
from gear.values.ground_truth import SurfaceTruth
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sample:
    """The fields that samples of every task have; a task adds its own fields in a subclass.

    Attributes:
        record: the complete scene.
        images: (H, W, 3) uint8 pictures in sRGB by camera name, row 0 at the top.
        surfaces: visibility and corners of each patch surface in each view.
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
"""Labels of the control datasets with which patches are compared: without a patch, and with a random patch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitInfo:
    """Names and seed of the split to which a sample belongs.

    Attributes:
        town, scene, split: names.
        seed: seed of the split.
        patch_label: `none`, `random`, or name and hash of the patch.
        created: ISO date for formats that store one. The date is part of the configuration, so the same configuration
            gives the same bytes.
    """

    town: str
    scene: str
    split: str
    seed: int
    patch_label: str
    created: str = "2022-01-01"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Encoded:
    """A sample, or a prediction, converted to files.

    Attributes:
        files: bytes by path relative to the dataset's root, with `/` between folders.
        facts: JSON data that `decode` and `finalise` need; stored in the sidecar, the JSON file of the sample.
    """

    files: Mapping[str, bytes]
    facts: Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Auxiliary:
    """A file of a sample in addition to the task's files, such as a probe (the sample with a black or white
    surface).

    Attributes:
        path: path relative to the dataset's root; the file's hash is among `files` of the sidecar.
        facts: JSON data that is needed to read the file.
    """

    path: str
    facts: Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sidecar:
    """The metadata that gear stores about each sample, in `gear/<split>/samples/<index>.json`.

    Attributes:
        record: the complete scene.
        surfaces: visibility and corners of each patch surface in each view.
        facts: JSON data that the task's `encode` returned.
        files: sha256 of each of the sample's files, by path relative to the dataset's root.
        auxiliary: further files by name; empty unless the collection requested them.
        device: graphics device, driver and processor that rendered the sample; empty unless the split has mixed
            devices.
    """

    record: SceneRecord
    surfaces: tuple[SurfaceTruth, ...]
    facts: Json
    files: Mapping[str, str]
    auxiliary: Mapping[str, Auxiliary] = field(default_factory=dict)
    device: Mapping[str, str] = field(default_factory=dict)


class Evaluator(Protocol[SampleT_contra, PredictionT_contra]):
    """A metric over a dataset, to which samples are added one by one."""

    def update(self, sample: SampleT_contra, prediction: PredictionT_contra) -> Mapping[str, float]:
        """Adds one sample with its prediction.

        Args:
            sample: the sample with its ground truth.
            prediction: its prediction in the task's form.

        Returns:
            Metrics of this sample alone, by name; empty if the metric is not defined for a single sample.
        """
        ...

    def merge(self, other: Any) -> None:
        """Adds the samples that another evaluator of the same class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        ...

    def result(self) -> Mapping[str, float]:
        """The metrics over all gathered samples, by name; NaN where a metric is undefined."""
        ...


class Task(Protocol[SampleT, PredictionT]):
    """A dataset format with its ground truth. A task object holds its options and no state between calls.

    `encode` and `finalise` return bytes and write no files; `gear.dataset` writes and hashes the files and resumes
    interrupted runs.
    """

    def rig(self) -> Rig:
        """The cameras of the task and their mounting positions on the ego car."""
        ...

    def ground_truth(self, frame: Frame, record: SceneRecord) -> SampleT:
        """Measures the ground truth of one rendered frame.

        Args:
            frame: colour, depth, ids and objects of all views.
            record: the scene that the frame shows.
        """
        ...

    def encode(self, sample: SampleT, info: SplitInfo) -> Encoded:
        """Converts one sample to files, without index files that several samples share.

        Args:
            sample: the sample; it is not changed.
            info: names and seed of the split.

        Returns:
            The files as bytes by path, with JSON data (`facts`) that `decode` and `finalise` need.
        """
        ...

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """The index files of a split, such as COCO's JSON, as bytes by path relative to the dataset's root.

        Args:
            sidecars: stored metadata of all samples of the split, in order of index.
            info: names and seed of the split.
        """
        ...

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> SampleT:
        """Reads one sample from its files: the exact inverse of `encode`.

        Args:
            root: folder of the dataset.
            sidecar: stored metadata of the sample.
            info: names and seed of the split.
        """
        ...

    def as_prediction(self, sample: SampleT) -> PredictionT:
        """The ground truth of a sample in the form of a perfect prediction, with which evaluators are tested.

        Args:
            sample: the sample with its ground truth.
        """
        ...

    def evaluator(self) -> Evaluator[SampleT, PredictionT]:
        """A new, empty evaluator of the task's metric."""
        ...

    def preview(self, sample: SampleT) -> Mapping[str, UInt8Image]:
        """Returns pictures of a sample to look at, by name: (H, W, 3) uint8, with labels, boxes or depth drawn in.

        Args:
            sample: the sample with its ground truth.
        """
        ...


Indexes = Mapping[str, bytes]
"""Bytes of the index files of a split by path."""


@runtime_checkable
class ExtendsIndexes(Protocol):
    """A task that can extend the index files of a split without reading all sidecars (JSON files of the samples)."""

    def extend(self, before: Indexes, start: int, sidecars: Sequence[Sidecar], info: SplitInfo) -> Indexes:
        """Makes the index files of a split from those of its first samples.

        The result equals `Task.finalise(sidecars, info)`, byte for byte.

        Args:
            before: bytes of the index files, by path, that the task made when the split had `start` samples.
            start: number of samples in these files.
            sidecars: the sidecars of all samples; each that is accessed is read from disk.
            info: names and seed of the split.
        """
        ...
