from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.specs import ModelSpec
from gear.testing.model_contract import ModelContract
from gear.testing.model_state import changes, state_of
from gear.testing.tiny_networks import TinyConfig, TinyDepth, TinySegmenter, tiny_depth, tiny_segmenter


class TestTinySegmenter(ModelContract):
    spec = tiny_segmenter


class TestTinyDepth(ModelContract):
    spec = tiny_depth


def contract_of(build: Any, **facts: Any) -> ModelContract:
    """The contract for a network that breaks a promise."""
    common: dict[str, Any] = {"tasks": ("semseg",), "views": ("left",), "taps": ("stem", "trunk")}
    spec = ModelSpec(name="liar", summary="Breaks a promise.", config=TinyConfig, build=build, **(common | facts))
    return type("Liar", (ModelContract,), {"spec": spec})()


class Peeks(TinySegmenter):
    def predict(self, views: Any, truth: Any = None) -> Any:
        return super().predict(views)


class Scribbles(TinySegmenter):
    def predict(self, views: Any) -> Any:
        views["left"][0, 0] = 0
        return super().predict(views)


class Learns(TinySegmenter):
    def predict(self, views: Any) -> Any:
        self.train()
        return super().predict(views)


class Blind(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Mapping[str, torch.Tensor]:
        return super().forward({name: torch.zeros_like(view) for name, view in views.items()}, targets)


class Gossips(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Mapping[str, torch.Tensor]:
        return super().forward({"left": views["left"] - views["left"].mean(0)}, targets)


class Detached(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Mapping[str, torch.Tensor]:
        return {k: v.detach() for k, v in super().forward(views, targets).items()}


class Transposed(TinySegmenter):
    def predict(self, views: Any) -> Any:
        return super().predict(views).T


class Trains(TinySegmenter):
    """Its losses want training's mode, in which batch normalisation learns."""

    def predict(self, views: Any) -> Any:
        self.eval()
        return super().predict(views)

    def loss(self, raw: torch.Tensor, targets: Any) -> torch.Tensor:
        self.train()
        return super().loss(raw, targets)


class Relabels(TinySegmenter):
    def loss(self, raw: torch.Tensor, targets: Any) -> torch.Tensor:
        for sample in targets:
            sample.label_ids[sample.label_ids == 7] = 0
        return super().loss(raw, targets)


class Shuffles(TinySegmenter):
    def predict_many(self, samples: Any) -> Any:
        return [self.predict(sample) for sample in reversed(samples)]


class ForgetsSome(TinySegmenter):
    def predict_many(self, samples: Any) -> Any:
        return [self.predict(samples[0])]


class InHalves(TinyDepth):
    def predict_many(self, samples: Any) -> Any:
        return [self.predict(sample) / 2 for sample in samples]


class LastDigits(TinyDepth):
    def predict_many(self, samples: Any) -> Any:
        return [self.predict(sample) * np.float32(1 + 1e-6) for sample in samples]


def random_weights(config: TinyConfig) -> TinySegmenter:
    return TinySegmenter(TinyConfig(seed=int(torch.randint(1 << 30, ()))))


@pytest.mark.parametrize(
    ("build", "test"),
    [
        (Peeks, "test_predict_sees_pictures_alone"),
        (Scribbles, "test_predict_repeats_and_leaves_everything_alone"),
        (Learns, "test_predict_repeats_and_leaves_everything_alone"),
        (Blind, "test_forward_looks_at_the_picture"),
        (Blind, "test_gradients_flow_where_declared"),
        (Gossips, "test_forward_takes_batches"),
        (Detached, "test_gradients_flow_where_declared"),
        (Transposed, "test_predictions_suit_the_evaluators"),
        (random_weights, "test_two_of_the_same_options_are_alike"),
        (Trains, "test_forward_leaves_everything_alone"),
        (Relabels, "test_forward_leaves_everything_alone"),
        (Shuffles, "test_many_are_predicted_as_one_by_one"),
        (ForgetsSome, "test_many_are_predicted_as_one_by_one"),
    ],
)
def test_the_contract_catches(build: Any, test: str) -> None:
    with pytest.raises((AssertionError, ValueError, RuntimeError)):
        getattr(contract_of(build), test)()
    getattr(contract_of(TinySegmenter), test)()


def test_the_last_digits_of_predictions_together_may_differ() -> None:
    with pytest.raises(AssertionError, match="another prediction than alone"):
        contract_of(InHalves, tasks=("depth",)).test_many_are_predicted_as_one_by_one()
    contract_of(LastDigits, tasks=("depth",)).test_many_are_predicted_as_one_by_one()


def test_the_contract_catches_a_tap_that_is_missing_or_never_runs() -> None:
    class Idle(TinySegmenter):
        def taps(self) -> Mapping[str, torch.nn.Module]:
            return {"stem": self.stem, "trunk": torch.nn.ReLU()}

    with pytest.raises(AssertionError):
        contract_of(Idle).test_taps_are_there()
    with pytest.raises(AssertionError):
        contract_of(TinySegmenter, taps=("stem",)).test_taps_are_there()


def test_a_change_of_a_buffer_is_seen() -> None:
    network = TinySegmenter(TinyConfig())
    before = state_of(network)
    network.norm.num_batches_tracked += 1
    assert changes(before, state_of(network)) == ["model.norm.num_batches_tracked"]


def test_a_model_that_only_holds_its_network_is_seen_through() -> None:
    @dataclass
    class Holder:
        network: TinySegmenter

        def taps(self) -> Mapping[str, torch.nn.Module]:
            return {}

    holder = Holder(TinySegmenter(TinyConfig()))
    before = state_of(holder)
    with torch.no_grad():
        holder.network.head.bias[0] = 7.0
    assert changes(before, state_of(holder)) == ["network.head.bias"]


def test_weights_follow_from_the_seed() -> None:
    picture = {"left": np.random.default_rng(1).integers(0, 256, (16, 24, 3), dtype=np.uint8)}
    first, other = (TinySegmenter(TinyConfig(seed=seed)).predict(picture) for seed in (1, 2))
    assert not np.array_equal(first, other)
