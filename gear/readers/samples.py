"""The samples of several splits as one sequence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, overload

from gear.augment.apply import shrunk
from gear.dataset.reading import Dataset
from gear.values.serial import Json


@dataclass(frozen=True, slots=True)
class Samples(Sequence[Any]):
    """A sequence of samples from several splits; a sample is read from disk when it is indexed.

    Attributes:
        datasets: the splits.
        places: pair (index of the split, index of the sample in the split) for each sample of the sequence.
        scale: factor by which pictures and ground truth are resized.
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
        """The metadata of the sequence for the record of a training: one JSON entry per split with `scene`, `weather`,
        `split`, `seed`, `patch`, number of `samples`, and `content` (hash of all that decides the pictures).
        """
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


def all_of(datasets: tuple[Dataset[Any], ...]) -> Samples:
    """Joins all samples of several splits into one sequence: first all of the first split, then all of the second, and
    so on.

    Args:
        datasets: the opened splits.
    """
    return Samples(datasets, tuple((i, k) for i, dataset in enumerate(datasets) for k in range(len(dataset))))
