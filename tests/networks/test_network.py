from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.networks.network import Network, as_batch
from gear.networks.options import NetworkOptions
from gear.networks.runtime import device_of, seeded
from gear.values.errors import GearError
from gear.values.rng import derive_rng


class Brightness(Network):
    """Two views; answers with each picture's mean and the batch it was in."""

    def __init__(self) -> None:
        super().__init__(nn.Conv2d(3, 1, 1), NetworkOptions(device="cpu"), views=("left", "right"))

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        return {"means": torch.stack([view.mean(dim=(1, 2, 3)) for view in pictures.values()], 1)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        return {"error": (outputs["means"][:, 0] - torch.tensor(targets)).abs().mean()}

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        return [(tuple(means.tolist()), size_px, len(outputs["means"])) for means in outputs["means"]]


def sample(height: int, width: int, index: int) -> dict[str, Any]:
    rng = derive_rng(index, "sample")
    return {name: rng.integers(0, 256, (height, width, 3), dtype=np.uint8) for name in ("left", "right", "rear")}


def test_a_batch_is_rgb_in_front_of_rows() -> None:
    views = sample(4, 6, 0)
    batch = as_batch([views, views], ("left",))
    assert batch.keys() == {"left"} and batch["left"].shape == (2, 3, 4, 6) and batch["left"].dtype == torch.float32
    assert float(batch["left"][1, 2, 3, 5]) == pytest.approx(views["left"][3, 5, 2] / 255)


def test_a_batch_takes_pictures_as_they_lie_in_memory() -> None:
    picture = sample(8, 6, 0)["left"]
    for seen in (picture[:, ::-1], picture[::2], picture[..., ::-1], np.broadcast_to(picture[:1, :1], picture.shape)):
        batch = as_batch([{"left": seen}, {"left": seen}], ("left",))["left"]
        wanted = np.stack([seen, seen]).transpose(0, 3, 1, 2).astype(np.float32) / 255
        assert batch.is_contiguous() and np.array_equal(batch.numpy(), wanted)


def test_a_batch_has_pictures_of_one_size_and_of_bytes() -> None:
    picture = sample(8, 6, 0)["left"]
    for other in (picture[:4], picture.astype(np.float32)):
        with pytest.raises(ValueError, match="uint8 pictures of one size"):
            as_batch([{"left": picture}, {"left": other}], ("left",))


def test_pictures_of_one_size_go_together_and_answers_keep_their_order() -> None:
    samples = [sample(*size, index) for index, size in enumerate([(4, 6), (8, 8), (4, 6)])]
    answers = Brightness().predict_many(samples)
    for views, (means, size, batch) in zip(samples, answers, strict=True):
        assert means == pytest.approx([views[name].mean() / 255 for name in ("left", "right")], abs=1e-5)
        assert size == views["left"].shape[:2] and batch == (1 if size == (8, 8) else 2)
    assert Brightness().predict_many([]) == []


def test_targets_turn_outputs_into_losses() -> None:
    model = Brightness()
    views = as_batch([sample(4, 6, 0)], ("left", "right"))
    means = model(views)["means"]
    assert float(model(views, [0.0])["error"]) == pytest.approx(float(means[0, 0]))


def test_a_network_is_ready_to_predict() -> None:
    model = Brightness()
    assert not model.training and model.taps() == {}
    assert model.module() is model.graph and model.device == torch.device("cpu")


def test_a_device_that_is_not_there_is_said() -> None:
    assert device_of("cpu") == torch.device("cpu")
    if torch.cuda.is_available():
        assert device_of("auto").type == device_of("cuda").type == "cuda"
    else:
        assert device_of("auto") == torch.device("cpu")
        with pytest.raises(GearError, match="no GPU"):
            device_of("cuda")


def test_seeds_stay_inside() -> None:
    before = torch.random.get_rng_state()
    with seeded(3):
        one = torch.rand(2)
    with seeded(3):
        assert torch.equal(torch.rand(2), one)
    assert torch.equal(torch.random.get_rng_state(), before)
