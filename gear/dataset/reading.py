"""Reads datasets: samples with typed fields, and pairs of samples that differ only in the patch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from gear.contracts.tasks import Sample, SampleT, Sidecar, Task
from gear.dataset.files import inside, read_bytes, sha256
from gear.dataset.html_preview import preview_table
from gear.dataset.layout import manifest_path, plan_path, sidecar_path
from gear.dataset.plan import Plan
from gear.dataset.sealed_json import REPAIR, DamagedError, load_sealed
from gear.dataset.sidecar import no_sidecar, read_sidecar
from gear.values.errors import DatasetError, FieldError
from gear.values.lazy_sequence import LazySequence
from gear.values.serial import Json, from_json

T = TypeVar("T")

SHOWN = 4
"""Number of samples in the notebook preview of a dataset."""


@dataclass(frozen=True, slots=True, repr=False)
class Dataset(LazySequence[SampleT], Generic[SampleT]):
    """One finished split: a sequence of samples, each read and decoded on access.

    Attributes:
        root: folder of the dataset.
        plan: everything that decided the bytes of the split.
        task: the task that wrote the split and decodes its samples.
        manifest: JSON with versions, renderer, configuration and hashes of all files (earlier versions: without those
            of sidecars).
    """

    root: Path
    plan: Plan
    task: Task[SampleT, Any]
    manifest: Json

    def __len__(self) -> int:
        return len(self.manifest["samples"])

    def __repr__(self) -> str:
        info = self.plan.info
        return (
            f"Dataset({str(self.root)!r}, split={info.split!r}, task={self.plan.task['name']!r},"
            f" patch={info.patch_label!r}, samples={len(self)})"
        )

    def _repr_html_(self) -> str:
        """The first samples as pictures, for notebooks."""
        shown = ((f"{i:06d}", self.task.preview(self[i])) for i in range(min(len(self), SHOWN)))
        return preview_table(repr(self), shown)

    def item(self, index: int) -> SampleT:
        """Reads and decodes the sample `index`; `dataset[index]` does the same, and counts negative indices from the
        end.

        Args:
            index: index of the sample.

        Raises:
            DatasetError: a file of the sample is missing, damaged, or cannot be read.
        """
        sidecar = self.sidecar(index)
        self._refuse_damaged(sidecar)
        try:
            return self.task.decode(self.root, sidecar, self.plan.info)
        except FieldError as error:  # facts are the task's own, which reads them with `from_json`
            path = self.root / sidecar_path(self.plan.info.split, index)
            raise no_sidecar(path, FieldError(f"facts.{error.field}", error.problem)) from error

    def sidecar(self, index: int) -> Sidecar:
        """The metadata of one sample without its pictures: scene record, surfaces, the task's metadata and file hashes.

        Args:
            index: index of the sample; a negative index counts from the end.

        Raises:
            IndexError: there is no such sample.
            DatasetError: the JSON file of the sample cannot be read.
        """
        if not -len(self) <= index < len(self):
            raise IndexError(f"sample {index} of {len(self)}")
        return read_sidecar(inside(self.root, sidecar_path(self.plan.info.split, index % len(self))))

    def _refuse_damaged(self, sidecar: Sidecar) -> None:
        """Checks the files that a sample is decoded from against the hashes in its sidecar.

        Raises:
            DamagedError: a file is missing, or its bytes are not those that were written.
        """
        auxiliary = {file.path for file in sidecar.auxiliary.values()}
        for relative, digest in sidecar.files.items():
            if relative not in auxiliary:
                check_hash(self.root, relative, digest)

    def named(self, what: str) -> str:
        """The name of the renderer or of the weather in the manifest.

        Args:
            what: `renderer` or `weather`.

        Raises:
            DatasetError: the manifest has no such name.
        """
        entry = self.manifest.get(what)
        name = entry.get("name") if isinstance(entry, dict) else None
        if not isinstance(name, str):
            path = self.root / manifest_path(self.plan.info.split)
            raise DatasetError(path, f"says no name of a {what}; delete it and run the same collection again")
        return name

    def content(self, kind: type[T], *keys: str) -> T:
        """One value in the `content` of the plan, the settings that decide the pictures.

        Args:
            kind: type of the value.
            keys: keys that lead to the value, from the outermost one on.

        Raises:
            DatasetError: there is no such value of that type, because the plan was edited.
        """
        value, name = self.plan.content, ".".join(("content", *keys))
        try:
            for key in keys:
                value = value[key]
            return from_json(kind, value, name)
        except (KeyError, TypeError, FieldError) as error:
            path = self.root / plan_path(self.plan.info.split)
            problem = str(error) if isinstance(error, FieldError) else f"{name}: missing"
            raise DatasetError(path, f"is not of this version of gear ({problem}); collect the split again") from error

    def verify(self) -> list[str]:
        """The relative paths of files that are missing or do not match the hashes in the manifest.

        `gear.verify` checks more, such as the plan, the manifest itself and unexpected files.
        """
        wanted: dict[str, str] = {**self.manifest["indexes"], **self.manifest.get("sidecars", {})}
        for sample in self.manifest["samples"]:
            wanted.update(sample["files"])
        return [relative for relative, digest in wanted.items() if not self._is_whole(relative, digest)]

    def _is_whole(self, relative: str, digest: str) -> bool:
        path = inside(self.root, relative)
        return path.is_file() and sha256(read_bytes(path)) == digest


def check_hash(root: Path, relative: str, digest: str) -> bytes:
    """Reads a file of a dataset and checks its hash.

    Args:
        root: root of the dataset.
        relative: path of the file relative to the root.
        digest: SHA-256 of the file when it was written.

    Raises:
        DamagedError: the file is missing, or has other bytes.
        DatasetError: the file cannot be read, or lies outside the root.
    """
    path = inside(root, relative)
    if not path.exists():
        raise DamagedError(path, f"is gone; {REPAIR}")
    data = read_bytes(path)
    if sha256(data) != digest:
        raise DamagedError(path, f"is damaged: its content does not match the sha256 in its sidecar; {REPAIR}")
    return data


def read_manifest(root: Path, plan: Plan) -> Json:
    """Reads the manifest of a finished split: JSON with metadata and the hashes of all files.

    Args:
        root: root folder of the dataset.
        plan: plan of the split.

    Raises:
        DatasetError: the split is not finished (it has no manifest, or more samples than the manifest lists), or the
            manifest is damaged or lists no files.
    """
    split = plan.info.split
    path = inside(root, manifest_path(split))
    finish = "run its `gear collect` again to complete it"
    if not path.exists():
        raise DatasetError(root, f"split {split!r} is not finished; {finish}")
    manifest = load_sealed(path)
    remedy = "delete it and run the same collection again"
    try:
        samples = manifest["samples"]
        files = {"indexes": manifest["indexes"], "sidecars": manifest.get("sidecars", {})}
        files |= {f"samples[{number}].files": sample["files"] for number, sample in enumerate(samples)}
    except (KeyError, TypeError) as error:
        raise DatasetError(path, f"is no manifest of this version of gear; {remedy}") from error
    if not isinstance(samples, list):
        raise DatasetError(path, f"has no list of samples; {remedy}")
    for key, one in files.items():
        try:
            from_json(dict[str, str], one, key)
        except FieldError as error:
            raise DatasetError(path, f"is no manifest of this version of gear ({error}); {remedy}") from error
    if len(samples) != plan.samples and _holds_more(root, split, len(samples)):
        problem = f"split {split!r} is not finished: {plan.samples} samples were begun, its manifest has {len(samples)}"
        raise DatasetError(root, f"{problem}; {finish}")
    return manifest


def _holds_more(root: Path, split: str, count: int) -> bool:
    """Whether a split has more samples than its manifest lists. A split for which more samples were requested, none of
    which exists yet, still counts as finished.
    """
    samples = inside(root, sidecar_path(split, 0)).parent
    return sum(1 for _ in samples.glob("*.json")) > count


def scenes_of(dataset: Dataset[Any]) -> tuple[str, int]:
    """A key that is equal for datasets with the same scenes, independent of their rendering: (`town/scene`, seed)."""
    info = dataset.plan.info
    return f"{info.town}/{info.scene}", info.seed


@dataclass(frozen=True, slots=True, repr=False)
class Twins(LazySequence[tuple[SampleT, SampleT]], Generic[SampleT]):
    """Two splits that differ only in their patch (twins), as a sequence of pairs of samples.

    Attributes:
        first: the split that provides the first sample of each pair.
        second: the split that provides the second sample of each pair.
    """

    first: Dataset[SampleT]
    second: Dataset[SampleT]

    def __len__(self) -> int:
        return min(len(self.first), len(self.second))

    def __repr__(self) -> str:
        return f"Twins({self.first!r}, {self.second!r})"

    def _repr_html_(self) -> str:
        """The first pairs as pictures, for notebooks."""
        rows = []
        for i in range(min(len(self), SHOWN)):
            for one in (self.first, self.second):
                rows.append((f"{i:06d} {one.plan.info.patch_label}", one.task.preview(one[i])))
        return preview_table(repr(self), rows)

    def item(self, index: int) -> tuple[SampleT, SampleT]:
        """Reads and decodes the pair of samples `index`."""
        return self.first[index], self.second[index]


def pair_twins(first: Dataset[Sample], second: Dataset[Sample]) -> Twins[Sample]:
    """Pairs the samples of two splits that differ only in their patch, by index.

    Args:
        first, second: the two splits.

    Raises:
        DatasetError: the splits differ in more than their patch.
    """
    if first.plan.twin_key != second.plan.twin_key:
        raise DatasetError(
            second.root,
            f"is no twin of {first.root}: they differ in more than the patch (compare their gear/*/plan.json)",
        )
    return Twins(first, second)
