"""The objective with optimised and with random patches."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gear.contracts.attacks import Patch
from gear.verbs.attack.achieved import compared, plain, random_patches

PATCHES = (
    Patch(name="patch_0", rgb=np.ones((4, 6, 3), np.float32)),
    Patch(name="patch_1", rgb=np.ones((2, 2, 3), np.float32)),
)


class Scenes:
    """Ten samples; the harm of patches is their mean."""

    samples = tuple(range(10))

    def harm(self, network: Any, objective: Any, patches: Any, chosen: list[int]) -> float:
        self.chosen = chosen
        return float(np.mean([patch.rgb.mean() for patch in patches]))


def test_random_patches_have_the_sizes_and_follow_the_seed() -> None:
    found = random_patches(PATCHES, 3)
    assert [(one.name, one.rgb.shape, one.rgb.dtype) for one in found] == [
        (one.name, one.rgb.shape, np.float32) for one in PATCHES
    ]
    assert np.array_equal(found[0].rgb, random_patches(PATCHES, 3)[0].rgb)
    assert not np.array_equal(found[0].rgb, random_patches(PATCHES, 4)[0].rgb)


def test_both_are_measured_on_the_same_evenly_spaced_samples() -> None:
    scenes: Any = Scenes()
    found: Any = compared(scenes, None, None, PATCHES, 0, max_samples=4)  # type: ignore[arg-type]
    assert scenes.chosen == [0, 3, 6, 9]
    assert found["samples"] == 4
    assert found["patch"] == 1.0
    assert 0 < found["random"] < 1
    everything: Any = compared(scenes, None, None, PATCHES, 0)  # type: ignore[arg-type]
    assert everything["samples"] == 10


def test_numbers_for_json_have_six_digits() -> None:
    assert plain(1.23456789) == 1.23457
    assert plain(math.nan) is None
    assert plain(-math.inf) is None
