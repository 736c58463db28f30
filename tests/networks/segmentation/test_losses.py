from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
import torch
from torch.nn import functional

from gear.formats.cityscapes import LABELS
from gear.networks.segmentation.losses import (
    BALANCED,
    SHARES,
    TRAIN_ID_OF_LABEL_ID,
    SegmentationLosses,
    hard_cross_entropy,
    sampled_ids,
    sampled_logits,
    train_ids,
)
from gear.values.rng import derive_rng


@dataclass
class Labelled:
    label_ids: npt.NDArray[np.uint8]


def logits_and_ids(ignored: float = 0.2) -> tuple[torch.Tensor, torch.Tensor]:
    rng = derive_rng(4, "logits")
    logits = torch.from_numpy(rng.normal(scale=3.0, size=(2, 19, 6, 10)))
    ids = torch.from_numpy(rng.integers(0, 19, size=(2, 6, 10)))
    ids[torch.from_numpy(rng.random((2, 6, 10)) < ignored)] = 255
    return logits, ids


def probabilities(logits: torch.Tensor, ids: torch.Tensor) -> torch.Tensor:
    """Of the right class, of every pixel that has one; written anew."""
    flat = logits.softmax(1).permute(0, 2, 3, 1).reshape(-1, 19)
    known = ids.reshape(-1) != 255
    return flat[known][torch.arange(int(known.sum())), ids.reshape(-1)[known]]


def test_labels_become_train_ids() -> None:
    ids = train_ids([Labelled(np.array([[7, 26, 0], [33, 9, 255]], dtype=np.uint8))], torch.device("cpu"))
    assert ids.dtype == torch.int64
    assert ids.tolist() == [[[0, 13, 255], [18, 255, 255]]]
    assert [TRAIN_ID_OF_LABEL_ID[label.id] for label in LABELS] == [label.train_id for label in LABELS]


def test_with_every_pixel_kept_it_is_plain_cross_entropy() -> None:
    logits, ids = logits_and_ids()
    expected = functional.cross_entropy(logits, ids, ignore_index=255)
    torch.testing.assert_close(hard_cross_entropy(logits, ids, easy=1.0, min_share=0.0), expected)


def test_only_hard_pixels_count() -> None:
    logits, ids = logits_and_ids()
    right = probabilities(logits, ids)
    hard = right[right < 0.3]
    assert 0 < len(hard) < len(right)
    loss = hard_cross_entropy(logits, ids, easy=0.3, min_share=0.0)
    torch.testing.assert_close(loss, -hard.log().mean())


def test_the_hardest_make_up_the_least_share() -> None:
    logits, ids = logits_and_ids()
    right = probabilities(logits, ids).sort().values
    count = math.ceil(0.25 * len(right))
    loss = hard_cross_entropy(logits, ids, easy=1e-6, min_share=0.25)
    torch.testing.assert_close(loss, -right[:count].log().mean())


def test_ignored_pixels_have_no_gradient() -> None:
    logits, ids = logits_and_ids()
    logits.requires_grad_(True)
    hard_cross_entropy(logits, ids, easy=1.0, min_share=0.1).backward()
    assert logits.grad is not None
    ignored = (ids == 255).unsqueeze(1).expand_as(logits)
    assert float(logits.grad[ignored].abs().max()) == 0
    assert float(logits.grad[~ignored].abs().min()) > 0


def test_pictures_without_a_class_cost_nothing() -> None:
    logits, ids = logits_and_ids()
    logits.requires_grad_(True)
    loss = hard_cross_entropy(logits, torch.full_like(ids, 255), easy=0.9, min_share=0.1)
    loss.backward()
    assert float(loss.detach()) == 0 and logits.grad is not None and float(logits.grad.abs().max()) == 0


def test_heads_are_weighed() -> None:
    samples = [Labelled(np.full((4, 6), 7, dtype=np.uint8))] * 2
    logits = torch.zeros(2, 19, 4, 6)
    losses = SegmentationLosses(easy=0.9, least=0.1, auxiliary_weight=0.4)(
        {"logits": logits, "auxiliary_0": logits}, samples
    )
    assert losses.keys() == {"cross_entropy", "auxiliary_0"}
    assert float(losses["cross_entropy"]) == pytest.approx(math.log(19))
    assert float(losses["auxiliary_0"]) == pytest.approx(0.4 * math.log(19))


@pytest.mark.parametrize("align_corners", [False, True])
@pytest.mark.parametrize("size_px", [(24, 40), (25, 41)])
def test_sampled_logits_equal_those_of_the_whole_picture_at_the_sampled_pixels(
    align_corners: bool, size_px: tuple[int, int]
) -> None:
    maps = torch.rand(4, 3, 5, 7, generator=torch.Generator().manual_seed(0))
    whole = torch.nn.functional.interpolate(maps, size=size_px, mode="bilinear", align_corners=align_corners)
    numbers = torch.arange(size_px[0] * size_px[1]).reshape(1, *size_px).expand(4, -1, -1)

    chosen = sampled_ids(numbers)
    sampled = sampled_logits(maps, size_px, align_corners=align_corners)

    wanted = whole.flatten(2).gather(2, chosen.flatten(1)[:, None].expand(-1, 3, -1)).reshape(sampled.shape)
    torch.testing.assert_close(sampled, wanted, atol=1e-5, rtol=0)
    even = numbers[0, : size_px[0] // 2 * 2, : size_px[1] // 2 * 2]
    assert set(chosen.flatten().tolist()) == set(even.flatten().tolist()), "four pictures together show every pixel"


def test_losses_compare_sampled_logits_with_the_labels_of_their_pixels() -> None:
    label_ids = np.full((16, 16), 7, dtype=np.uint8)
    label_ids[0::2, 0::2] = 26  # what the first picture of a batch looks at
    sample = Labelled(label_ids=label_ids)
    logits = torch.zeros(2, 19, 8, 8)
    logits[0, 13], logits[1, 0] = 20, 20  # car, road

    losses = SegmentationLosses(easy=1.0, least=0.0, auxiliary_weight=0.0)({"logits": logits}, [sample, sample])

    assert float(losses["cross_entropy"]) == pytest.approx(0.0, abs=1e-4)


def test_weights_make_a_mean_of_classes_as_they_say() -> None:
    logits, ids = torch.zeros(1, 2, 1, 4), torch.tensor([[[0, 0, 0, 1]]])
    logits[:, 0] = 1.0
    common, rare = -math.log(math.e / (math.e + 1)), -math.log(1 / (math.e + 1))

    loss = hard_cross_entropy(logits, ids, easy=1.0, min_share=0.0, weights=(1.0, 3.0))
    ignored = hard_cross_entropy(logits, torch.full_like(ids, 255), easy=1.0, min_share=0.0, weights=(1.0, 3.0))

    assert float(loss) == pytest.approx((3 * common + 3 * rare) / 6)
    assert float(ignored) == 0


def test_rarer_classes_weigh_more() -> None:
    order = np.argsort(SHARES, kind="stable")
    assert np.all(np.diff(np.array(BALANCED)[order]) <= 0)
    assert 1.9 < min(BALANCED) < 2.1 and max(BALANCED) < 7.2
