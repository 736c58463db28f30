"""What tests of `gear attack` share: settings of small patches, options of none, a defense around the model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch

from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import PerPicture
from tests.verbs.conftest import Nothing

SMALL = ["height_px=12", "width_px=24", "batch=1"]


class Inverted:
    """A model that is shown negatives."""

    def __init__(self, bare: Any) -> None:
        self.bare = bare

    def predict(self, views: Any) -> Any:
        return self.bare.predict({name: 255 - picture for name, picture in views.items()})

    def forward(self, views: Any, targets: Any = None) -> Any:
        return self.bare.forward({name: 1 - pictures for name, pictures in views.items()}, targets)

    def taps(self) -> Mapping[str, Any]:
        return {}


class Wrapping(PerPicture):
    """A defense that does all it does around the model."""

    def __init__(self, config: Nothing) -> None:
        pass

    def clean(self, picture: Any) -> Any:
        return picture, None

    def clean_tensor(self, pictures: torch.Tensor) -> torch.Tensor:
        return pictures

    def wrap(self, model: Any) -> Any:
        return Inverted(model)


wrapping = DefenseSpec(name="wrapping", summary="Wraps.", config=Nothing, build=Wrapping, gradient="differentiable")
