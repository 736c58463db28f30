from __future__ import annotations

import numpy as np
import pytest
import torch
from torch.nn import functional

from gear.networks.segmentation import label_maps
from gear.networks.segmentation.label_maps import best_class, best_class_at


def maps(height: int, width: int) -> torch.Tensor:
    return torch.randn(19, height, width, generator=torch.Generator().manual_seed(height)) * 3


def test_the_best_class_is_the_first_of_the_largest() -> None:
    logits = maps(33, 17).round()
    assert bool((logits == logits.max(0).values).sum(0).max() > 1), "there are ties"
    assert np.array_equal(best_class(logits), logits.argmax(0).numpy())
    assert np.array_equal(label_maps._on_device(logits), logits.argmax(0).numpy())


@pytest.mark.parametrize("align_corners", [False, True])
@pytest.mark.parametrize(
    ("inner", "outer"),
    [((24, 48), (256, 512)), ((12, 20), (100, 150)), ((47, 153), (370, 1224)), ((1, 1), (7, 9)), ((9, 5), (9, 5)),
     ((64, 64), (20, 30))],
)  # fmt: skip
def test_band_by_band_is_the_same_as_all_at_once(
    inner: tuple[int, int], outer: tuple[int, int], align_corners: bool
) -> None:
    small = maps(*inner)
    whole = functional.interpolate(small[None], size=outer, mode="bilinear", align_corners=align_corners)[0]
    best = best_class_at(small, outer, align_corners=align_corners)
    assert best.dtype == np.uint8 and best.shape == outer
    assert np.array_equal(best, whole.argmax(0).numpy())


def test_channels_last_is_the_same() -> None:
    small = maps(12, 20)
    last = small[None].contiguous(memory_format=torch.channels_last)[0]
    assert not last.is_contiguous()
    assert np.array_equal(
        best_class_at(last, (50, 70), align_corners=False), best_class_at(small, (50, 70), align_corners=False)
    )
