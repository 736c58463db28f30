"""Several datasets as one for an attack."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
import torch
from torch import Tensor

from gear.values.errors import DatasetError
from gear.verbs.attack.data import JoinedCompositor, check_joined


class Numbered:
    """A compositor whose pictures hold its number, the sample and the mean of the patch."""

    def __init__(self, number: int) -> None:
        self.number = number

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        pictures = torch.zeros(len(samples), 3, 1, 1)
        for place, sample in enumerate(samples):
            patch = patches[0] if patches[0].ndim == 3 else patches[0][place]
            pictures[place, :, 0, 0] = torch.tensor([self.number, sample, float(patch.mean())])
        return pictures


def joined() -> JoinedCompositor:
    samples: Any = SimpleNamespace(places=((0, 0), (0, 1), (1, 0), (1, 1)))
    return JoinedCompositor(samples, [Numbered(10), Numbered(20)])


def test_each_sample_is_composed_by_its_own_compositor() -> None:
    patch = torch.full((3, 2, 2), 0.5)
    found = joined().compose([patch], [0, 3, 1], "left")[:, :, 0, 0].tolist()
    assert found == [[10, 0, 0.5], [20, 1, 0.5], [10, 1, 0.5]]


def test_patches_of_each_sample_stay_with_it() -> None:
    patches = torch.stack([torch.full((3, 2, 2), value) for value in (0.25, 0.75)])
    assert joined().compose([patches], [2, 0], "left")[:, 2, 0, 0].tolist() == [0.25, 0.75]
    assert joined().compose([patches], [2, 3], "left")[:, 2, 0, 0].tolist() == [0.25, 0.75]


class Split:
    def __init__(
        self, root: str, *, task: str = "depth", patch: str = "none", surfaces: int = 1, width: int = 8
    ) -> None:
        self.root = root
        self.plan = SimpleNamespace(task={"name": task}, patch={"label": patch})
        cameras = [SimpleNamespace(name="left", width_px=width, height_px=4)]
        self.record = SimpleNamespace(surfaces=[None] * surfaces, cameras=cameras)

    def sidecar(self, index: int) -> Any:
        return SimpleNamespace(record=self.record)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"surfaces": 0}, "b: has no patch surface"),
        ({"patch": "mine-1234"}, "b: shows the patch mine-1234 itself"),
        ({"task": "semseg"}, "b: has task semseg, but a has depth"),
        ({"surfaces": 2}, "b: has patch surfaces 2, but a has 1"),
        ({"width": 16}, "b: has pictures of"),
    ],
)
def test_datasets_that_do_not_fit_together_are_named(other: dict[str, Any], message: str) -> None:
    first: Any = Split("a")
    second: Any = Split("b", **other)
    with pytest.raises(DatasetError, match=message):
        check_joined([first, second])


def test_controls_may_be_mixed() -> None:
    splits: Any = [Split("a"), Split("b", patch="random")]
    check_joined(splits)
