"""Selects training samples, and splits off samples for validation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gear.dataset.reading import Dataset, scenes_of
from gear.readers import Samples
from gear.values.errors import GearError
from gear.values.rng import derive_rng

TRAINING = ("finetuning", "train")
VALIDATION = ("val",)


def spread(samples: Samples, max_count: int) -> Samples:
    """Returns at most `max_count` of the samples, evenly spaced over the sequence, in its order."""
    count = min(max_count, len(samples))
    return Samples(samples.datasets, tuple(samples.places[i * len(samples) // count] for i in range(count)))


def keep_some(samples: Samples, share: float, seed: int) -> tuple[Samples, Samples]:
    """Splits samples into training samples and validation samples.

    All samples of a sequence, in every weather and with every patch, go to the same side. Therefore no scene content of
    the validation occurs in training.

    Args:
        samples: all samples.
        share: share of the samples that is held out for validation, 0..1.
        seed: seed of the draw.

    Returns:
        The training samples, and the validation samples.

    Raises:
        GearError: there are too few samples.
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
    """Returns for each dataset the index of the first dataset with the same scene content, in any weather and with
    any patch.
    """
    keys = [scenes_of(dataset) for dataset in datasets]
    return [keys.index(key) for key in keys]


def _sequence(samples: Samples, place: tuple[int, int], streets: Sequence[int]) -> tuple[int, int]:
    """Returns an identifier of the driving sequence that a sample belongs to; most sequences consist of one picture."""
    frames = max(samples.datasets[place[0]].content(int, "frames"), 1)
    return streets[place[0]], place[1] // frames
