"""Training data: finished splits behind each other, and a share of them kept for validation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

from gear.augment.apply import shrunk
from gear.dataset.reading import Dataset, scenes_of
from gear.dataset.store import splits_of
from gear.opening import open_dataset, root_and_split, roots_of
from gear.values.errors import DatasetError, GearError
from gear.values.rng import derive_rng
from gear.values.serial import Json

TRAINING = ("finetuning", "train")
VALIDATION = ("val",)
KEPT_FOR_TESTS = "test"


@dataclass(frozen=True, slots=True)
class Samples(Sequence[Any]):
    """Samples of several splits, read when they are asked for.

    Attributes:
        datasets: where they come from.
        places: (number of the dataset, index in it) of each.
        scale: share of their size at which their pictures are shown.
    """

    datasets: tuple[Dataset[Any], ...]
    places: tuple[tuple[int, int], ...]
    scale: float = 1.0

    def __len__(self) -> int:
        return len(self.places)

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Any]: ...
    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return replace(self, places=self.places[index])
        dataset, place = self.places[index]
        return shrunk(self.datasets[dataset][place], self.scale)

    def facts(self) -> list[Json]:
        """What it is made of, without the machine's paths; JSON."""
        numbers = [dataset for dataset, _ in self.places]
        return [
            {
                "scene": f"{dataset.plan.info.town}/{dataset.plan.info.scene}",
                "weather": dataset.named("weather"),
                "split": dataset.plan.info.split,
                "seed": dataset.plan.info.seed,
                "patch": dataset.plan.info.patch_label,
                "samples": numbers.count(number),
                "content": dataset.plan.content_key,
            }
            for number, dataset in enumerate(self.datasets)
            if number in numbers
        ]


def open_all(
    paths: Iterable[str | Path], task: str, *, names: Sequence[str], allow_tests: bool = False
) -> tuple[Dataset[Any], ...]:
    """Opens every split that the paths mean.

    Args:
        paths: each is a dataset's root, a folder of roots, or a root and a split as `DIR:SPLIT`.
        task: that they must be of.
        names: splits to take where a root holds several.
        allow_tests: whether `test` splits may be learnt from.

    Raises:
        DatasetError: there is none, one is of another task, or not finished.
        GearError: it is a test split, or two are of the same samples.
    """
    found = [dataset for path in paths for dataset in _open(path, names)]
    known: dict[Any, Dataset[Any]] = {}
    for dataset in found:
        same = known.setdefault((dataset.plan.twin_key, *sorted(dataset.plan.patch.items())), dataset)
        if same is not dataset:
            raise GearError(f"{same.root} and {dataset.root} hold the same samples; give them once")
        split = dataset.plan.info.split
        if dataset.plan.task["name"] != task:
            raise DatasetError(dataset.root, f"holds a {dataset.plan.task['name']} dataset, not {task}")
        if split.split("_")[0] == KEPT_FOR_TESTS and not allow_tests:
            raise GearError(
                f"{dataset.root}: split {split!r} is what networks are tested on, so it is not learnt from; collect a "
                "split such as finetuning, or say --allow-test-data if nothing will be reported on it"
            )
    return tuple(found)


def _open(path: str | Path, names: Sequence[str]) -> list[Dataset[Any]]:
    root, split = root_and_split(path)
    if not root.is_dir():
        raise DatasetError(root, "there is no such folder")
    roots = roots_of(root)
    if not roots:
        raise DatasetError(root, "holds no dataset of gear's (there is no gear/<split>/plan.json below it)")
    return [open_dataset(place, name) for place in roots for name in ([split] if split else _wanted(place, names))]


def _wanted(root: Path, names: Sequence[str]) -> list[str]:
    there = splits_of(root)
    chosen = [name for name in there if name.split("_")[0] in names]
    if len(there) == 1 or not chosen:
        if len(there) > 1:
            raise DatasetError(root, f"holds several splits ({', '.join(there)}); say which as DIR:SPLIT")
        return list(there)
    return chosen


def all_of(datasets: tuple[Dataset[Any], ...]) -> Samples:
    """Every sample, in order."""
    return Samples(datasets, tuple((i, k) for i, dataset in enumerate(datasets) for k in range(len(dataset))))


def spread(samples: Samples, most: int) -> Samples:
    """At most so many of them, evenly spread."""
    count = min(most, len(samples))
    return Samples(samples.datasets, tuple(samples.places[i * len(samples) // count] for i in range(count)))


def keep_some(samples: Samples, share: float, seed: int) -> tuple[Samples, Samples]:
    """Samples to train on and samples to validate on. Whole sequences go to either side, in every weather and with
    every patch that there is of them, so that what a picture shows is never seen on the other.

    Raises:
        GearError: there are too few.
    """
    streets = _streets(samples.datasets)
    sequences = [_sequence(samples, place, streets) for place in samples.places]
    groups = sorted(set(sequences))
    count = max(1, round(share * len(groups)))
    if count >= len(groups):
        raise GearError(f"{len(groups)} training sequences are too few to keep some for validation; give --val DIR")
    drawn = derive_rng(seed, "validation").permutation(len(groups))[:count]
    kept = {groups[i] for i in drawn}
    train = tuple(place for place, group in zip(samples.places, sequences, strict=True) if group not in kept)
    val = tuple(place for place, group in zip(samples.places, sequences, strict=True) if group in kept)
    return Samples(samples.datasets, train), Samples(samples.datasets, val)


def _streets(datasets: Sequence[Dataset[Any]]) -> list[int]:
    """For each dataset the number of the first one that shows the same streets, in whatever weather, with whatever
    patch."""
    keys = [scenes_of(dataset) for dataset in datasets]
    return [keys.index(key) for key in keys]


def _sequence(samples: Samples, place: tuple[int, int], streets: Sequence[int]) -> tuple[int, int]:
    """Which drive a sample is of; most are one picture long."""
    frames = max(samples.datasets[place[0]].content(int, "frames"), 1)
    return streets[place[0]], place[1] // frames
