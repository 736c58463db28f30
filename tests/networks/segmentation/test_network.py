from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch
from torch import Tensor, nn

from gear.formats.cityscapes import LABELS
from gear.networks.network import IMAGENET_MEAN, IMAGENET_STD, as_batch
from gear.networks.options import SegmentationOptions
from gear.networks.segmentation.losses import SegmentationLosses
from gear.networks.segmentation.network import CLASSES, LABEL_ID_OF_TRAIN_ID, LABEL_IDS, SemsegNetwork, inner_size
from gear.networks.weights import write
from gear.plugins.models.ddrnet23_slim import build
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

SIZES = [(64, 128), (72, 120), (61, 131), (200, 90)]


@dataclass
class Labelled:
    label_ids: npt.NDArray[np.uint8]


class Means(nn.Module):
    """One logit map is the blue channel in 1/8 of the size, the others are flat; remembers what it was shown."""

    align_corners = False

    def __init__(self) -> None:
        super().__init__()
        self.bias = nn.Parameter(torch.zeros(1))
        self.seen = torch.empty(0)

    def forward(self, pictures: Tensor, *, auxiliary: bool = False) -> list[Tensor]:
        self.seen = pictures.detach()
        blue = nn.functional.avg_pool2d(pictures[:, 2:], 8)
        maps = torch.cat([torch.full_like(blue, -50.0).repeat(1, CLASSES - 1, 1, 1), blue], 1) + self.bias
        return [maps, maps * 2] if auxiliary else [maps]

    def taps(self) -> dict[str, nn.Module]:
        return {}


def network(graph: nn.Module | None = None, **options: Any) -> SemsegNetwork:
    losses = SegmentationLosses(easy=1.0, least=0.0, auxiliary_weight=0.5)
    config = SegmentationOptions(weights="none", device="cpu", **options)
    return SemsegNetwork(graph or Means(), config, losses)


def picture(height: int, width: int, index: int = 0) -> npt.NDArray[np.uint8]:
    return derive_rng(2, "picture", index).integers(0, 256, (height, width, 3), dtype=np.uint8)


def test_train_ids_map_back_to_their_labels() -> None:
    assert len(LABEL_ID_OF_TRAIN_ID) == 19
    assert all(LABELS[id].train_id == train_id for train_id, id in enumerate(LABEL_ID_OF_TRAIN_ID))


@pytest.mark.parametrize(
    ("size", "scale", "inner"),
    [
        ((1024, 2048), 1.0, (1024, 2048)),
        ((1024, 2048), 0.5, (512, 1024)),
        ((370, 1224), 1.0, (368, 1224)),
        ((3, 5), 1.0, (8, 8)),
        ((100, 100), 0.01, (8, 8)),
    ],
)
def test_the_network_runs_at_multiples_of_its_stride(
    size: tuple[int, int], scale: float, inner: tuple[int, int]
) -> None:
    assert inner_size(size, scale) == inner


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scale", [1.0, 0.5, 1.7])
def test_logits_have_the_pictures_size(size: tuple[int, int], scale: float) -> None:
    graph = Means()
    model = network(graph, input_scale=scale)
    views = {"left": torch.rand(2, 3, *size, requires_grad=True)}
    logits = model(views)["logits"]
    assert logits.shape == (2, 19, *size) and logits.dtype == torch.float32
    assert tuple(graph.seen.shape[2:]) == inner_size(size, scale)
    (gradient,) = torch.autograd.grad(logits[:, -1].sum(), views["left"])
    assert float(gradient[:, 2].abs().sum(dim=(0, 2)).min()) > 0, "every column has its say"
    assert model.predict({"left": picture(*size)}).shape == size


def test_pictures_are_normalised_once() -> None:
    graph = Means()
    pictures = torch.rand(1, 3, 16, 24)
    network(graph)({"left": pictures})
    mean, std = (torch.tensor(values).view(3, 1, 1) for values in (IMAGENET_MEAN, IMAGENET_STD))
    torch.testing.assert_close(graph.seen[0], (pictures[0] - mean) / std)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_what_is_seen_stays_where_it_is(scale: float) -> None:
    """A bright square is found where it lies, also when the network looks at a smaller or a stretched picture."""
    for size in ((96, 160), (100, 156)):
        pictures = torch.zeros(1, 3, *size)
        pictures[:, 2, 32:64, 80:128] = 1.0
        response = network(input_scale=scale)({"left": pictures})["logits"][0, -1].detach()
        weight = (response - response.min()).double()
        rows, columns = torch.meshgrid(torch.arange(size[0]), torch.arange(size[1]), indexing="ij")
        assert float((weight * rows).sum() / weight.sum()) == pytest.approx(47.5, abs=1.0)
        assert float((weight * columns).sum() / weight.sum()) == pytest.approx(103.5, abs=1.0)


def test_predictions_are_the_best_of_the_outputs() -> None:
    """Predictions take a shorter way than logits of the picture's size."""
    model = build(SegmentationOptions(weights="none", device="cpu"))
    views = {"left": picture(100, 156)}
    logits = model(as_batch([views], ("left",)))["logits"][0]
    best = LABEL_IDS[logits.argmax(0).numpy()]
    assert len(np.unique(best)) > 2 and float((model.predict(views) == best).mean()) > 0.999


def test_predictions_are_label_ids() -> None:
    labels = network().predict({"left": picture(16, 24)})
    assert labels.dtype == np.uint8 and labels.shape == (16, 24)
    assert set(np.unique(labels)) == {33}, "the last train id is a bicycle"


def test_many_at_once_are_the_same_as_one_by_one() -> None:
    model = build(SegmentationOptions(weights="none", device="cpu"))
    samples = [{"left": picture(*size, index=i)} for i, size in enumerate([(64, 96), (72, 64), (64, 96)])]
    together = model.predict_many(samples)
    alone = [model.predict(sample) for sample in samples]
    assert [labels.shape for labels in together] == [(64, 96), (72, 64), (64, 96)]
    assert all(np.mean(a == b) > 0.99 for a, b in zip(together, alone, strict=True))
    assert not np.array_equal(alone[0], alone[2])


def test_it_learns() -> None:
    """Twenty steps on two pictures of coloured stripes teach the stripes' classes."""
    model = build(SegmentationOptions(weights="none", device="cpu"))
    labels = np.repeat(np.array([7, 23, 26, 21], dtype=np.uint8), 16)[:, None] * np.ones((1, 64), dtype=np.uint8)
    colours = derive_rng(6, "stripes").random((34, 3), dtype=np.float32)
    views = {"left": torch.from_numpy(colours[np.stack([labels, labels[::-1]])]).permute(0, 3, 1, 2).contiguous()}
    samples = [Labelled(labels), Labelled(np.ascontiguousarray(labels[::-1]))]
    optimiser = torch.optim.AdamW(model.parameters(), lr=2e-3)
    model.train()
    for _ in range(20):
        optimiser.zero_grad()
        total = torch.stack(list(model(views, samples).values())).sum()
        total.backward()
        optimiser.step()
    with torch.no_grad():
        logits = model(views)["logits"]
    right = LABEL_IDS[logits.argmax(1).numpy()] == np.stack([sample.label_ids for sample in samples])
    assert right.mean() > 0.9


def test_losses_see_all_heads_and_outputs_only_the_main_one() -> None:
    model = network()
    views = {"left": torch.rand(2, 3, 16, 24)}
    samples = [Labelled(np.full((16, 24), 33, dtype=np.uint8))] * 2
    assert model(views).keys() == {"logits"}
    assert model(views, samples).keys() == {"cross_entropy", "auxiliary_0"}


def test_bfloat16_gives_floats_close_to_the_same() -> None:
    whole = build(SegmentationOptions(weights="none", device="cpu"))
    short = build(SegmentationOptions(weights="none", device="cpu", precision="bfloat16"))
    views = {"left": torch.rand(1, 3, 64, 128)}
    with torch.no_grad():
        exact, rough = whole(views)["logits"], short(views)["logits"]
    assert rough.dtype == torch.float32
    assert 0 < float((exact - rough).abs().max()) < 0.1 * float(exact.abs().max())


def test_weights_say_at_which_scale_they_were_trained(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    fresh = build(SegmentationOptions(weights="none", device="cpu"))
    write(path, fresh.module().state_dict(), {"options": '{"input_scale": 0.5}'})
    assert fresh.input_scale == 1.0
    assert build(SegmentationOptions(weights=str(path), device="cpu")).input_scale == 0.5
    assert build(SegmentationOptions(weights=str(path), device="cpu", input_scale=2.0)).input_scale == 2.0
    with pytest.raises(GearError, match="13 not known"):
        build(SegmentationOptions(weights=str(path), device="cpu", auxiliary=False))


@pytest.mark.parametrize("scale", [0.0, -1.0, 5.0])
def test_a_scale_that_makes_no_sense_is_refused(scale: float) -> None:
    with pytest.raises(FieldError, match="input_scale"):
        SegmentationOptions(input_scale=scale)
