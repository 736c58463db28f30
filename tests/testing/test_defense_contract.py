"""The defense contract, held by a small honest defense and broken by dishonest ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.defenses import DefenseResult
from gear.contracts.specs import DefenseSpec
from gear.testing.defense_contract import DefenseContract


@dataclass(frozen=True, kw_only=True)
class Config:
    share_unit: float = 0.5


class Dims:
    """Darkens pictures; takes what is bright for the patch."""

    def __init__(self, config: Config) -> None:
        self.config = config

    def fit(self, clean: Any, patched: Any, model: Any, rng: np.random.Generator) -> Any:
        return None

    def apply(self, views: Mapping[str, Any], model: Any, state: Any, rng: np.random.Generator) -> DefenseResult:
        mask = {name: (picture.mean(axis=2) / 255).astype(np.float32) for name, picture in views.items()}
        dimmed = {name: np.rint(picture * self.config.share_unit).astype(np.uint8) for name, picture in views.items()}
        return DefenseResult(views=dimmed, mask=mask, score=float(np.mean([one.mean() for one in mask.values()])))

    def forward(self, views: Any) -> Any:
        raise ValueError("no gradient passes")

    def wrap(self, model: Any) -> Any:
        return model


def spec_of(build: Any) -> DefenseSpec[Config]:
    outputs: Any = frozenset({"images", "mask", "score"})
    return DefenseSpec(name="dims", summary="Darkens pictures.", config=Config, build=build, outputs=outputs)


class TestDims(DefenseContract):
    spec = spec_of(Dims)


class Remembers(Dims):
    """Its masks and scores lean on those of the sample before."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.before: DefenseResult | None = None

    def apply(self, *rest: Any) -> DefenseResult:
        result, before = super().apply(*rest), self.before
        self.before = result
        return result if before is None else self.blended(result, before)


class RemembersScores(Remembers):
    def blended(self, now: Any, before: Any) -> DefenseResult:
        return dataclasses.replace(now, score=(now.score + before.score) / 2)


class RemembersMasks(Remembers):
    def blended(self, now: Any, before: Any) -> DefenseResult:
        return dataclasses.replace(now, mask={name: (one + before.mask[name]) / 2 for name, one in now.mask.items()})


class ScoresInNumpy(Dims):
    def apply(self, *rest: Any) -> Any:
        result = super().apply(*rest)
        return dataclasses.replace(result, score=np.float32(result.score))  # type: ignore[arg-type]


class ScoresInTensors(Dims):
    def apply(self, *rest: Any) -> Any:
        result = super().apply(*rest)
        return dataclasses.replace(result, score=torch.tensor(result.score))  # type: ignore[arg-type]


class MasksOneCamera(Dims):
    def apply(self, *rest: Any) -> Any:
        result = super().apply(*rest)
        assert result.mask is not None
        return dataclasses.replace(result, mask={"left": result.mask["left"]})


class GivesAnythingWithViews(Dims):
    def apply(self, *rest: Any) -> Any:
        result = super().apply(*rest)
        return SimpleNamespace(views=result.views, mask=result.mask, score=result.score)


class WrapsNothing(Dims):
    def wrap(self, model: Any) -> Any:
        return None


class Unwrapped:
    """Everything but `wrap`."""

    def __init__(self, config: Config) -> None:
        self.fit, self.apply, self.forward = Dims(config).fit, Dims(config).apply, Dims(config).forward


@pytest.mark.parametrize(
    ("build", "test"),
    [
        (RemembersScores, "test_samples_do_not_touch_each_other"),
        (RemembersMasks, "test_samples_do_not_touch_each_other"),
        (ScoresInNumpy, "test_outputs_are_what_the_spec_declares"),
        (ScoresInTensors, "test_outputs_are_what_the_spec_declares"),
        (MasksOneCamera, "test_outputs_are_what_the_spec_declares"),
        (GivesAnythingWithViews, "test_pictures_keep_shape_and_type"),
        (WrapsNothing, "test_a_wrapped_model_is_a_model"),
        (Unwrapped, "test_a_wrapped_model_is_a_model"),
    ],
)
def test_the_contract_catches(build: Any, test: str) -> None:
    with pytest.raises((AssertionError, AttributeError)):
        getattr(type("Liar", (DefenseContract,), {"spec": spec_of(build)})(), test)()
