"""Joins several datasets, and their compositors, into one set of samples on which an attack optimises."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from gear.contracts.attacks import Compositor
from gear.contracts.tasks import CONTROLS
from gear.dataset.reading import Dataset
from gear.readers import Samples
from gear.values.errors import DatasetError


class JoinedCompositor:
    """Puts patches into the samples of several datasets; samples are addressed by their index in the joined set of
    samples.
    """

    def __init__(self, samples: Samples, compositors: Sequence[Compositor]) -> None:
        """Joins the compositors of several datasets.

        Args:
            samples: the joined set of samples.
            compositors: one compositor per dataset, in the order of `samples.datasets`.
        """
        self._samples, self._compositors = samples, tuple(compositors)

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Puts patches into the pictures of one camera.

        Args:
            patches: one tensor per surface, (3, h, w) for all samples or (B, 3, h, w) with one patch per sample.
            samples: indices of the B samples.
            view: name of the camera.

        Returns:
            (B, 3, H, W) float32 pictures in 0..1.
        """
        places = [self._samples.places[index] for index in samples]
        if len({dataset for dataset, _ in places}) == 1:
            return self._compositors[places[0][0]].compose(patches, [place for _, place in places], view)
        pictures = []
        for number, (dataset, place) in enumerate(places):
            mine = [patch if patch.ndim == 3 else patch[number] for patch in patches]
            pictures.append(self._compositors[dataset].compose(mine, [place], view))
        return torch.cat(pictures)


def check_joined(datasets: Sequence[Dataset[Any]]) -> None:
    """Checks that one set of patches fits all datasets.

    Raises:
        DatasetError: the datasets differ in task, picture size or number of surfaces; a dataset has no surface; or a
            dataset shows an adversarial patch, so clean predictions are not available.
    """
    first = datasets[0]
    facts = [_facts(dataset) for dataset in datasets]
    for dataset, found in zip(datasets, facts, strict=True):
        if not found["patch surfaces"]:
            raise DatasetError(dataset.root, "has no patch surface; attack a scene with a billboard or the truck")
        if (label := dataset.plan.patch["label"]) not in CONTROLS:
            problem = f"shows the patch {label} itself; collect the scene with --patch none or random, and name that"
            raise DatasetError(dataset.root, problem)
        for name, value in found.items():
            if value != facts[0][name]:
                raise DatasetError(dataset.root, f"has {name} {value}, but {first.root} has {facts[0][name]}")


def _facts(dataset: Dataset[Any]) -> dict[str, Any]:
    record = dataset.sidecar(0).record
    return {
        "task": dataset.plan.task["name"],
        "patch surfaces": len(record.surfaces),
        "pictures of": [(camera.name, camera.width_px, camera.height_px) for camera in record.cameras],
    }
