"""Models that contain other models: a group of models that are attacked together, and a model behind a defense."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from gear.contracts.defenses import DefendedBatch, Defense
from gear.contracts.models import Model
from gear.networks.runtime import as_bytes
from gear.plugins.attacks.optimisation.frozen_model import networks_of
from gear.values.frames import UInt8Image

DefendsBatches = Callable[[Mapping[str, Tensor]], DefendedBatch]
CleansBatches = Callable[[Mapping[str, Tensor]], Mapping[str, Tensor]]
"""A function that cleans pictures; it takes and returns (B, 3, H, W) tensors in 0..1 by camera name."""


class Group(nn.Module):
    """Several models that are attacked together. Outputs, losses and taps of a member are named `<member>/<name>`.

    Attributes:
        members: the models by name.
        device: name of the first member's device.

    Args:
        members: the models by name, at least one.
    """

    def __init__(self, members: Mapping[str, Model]) -> None:
        super().__init__()
        self.members = dict(members)
        self.device = device_name(next(iter(members.values())))
        self.networks = _networks(*members.values())

    def predict(self, views: Mapping[str, UInt8Image]) -> dict[str, Any]:
        """Returns the prediction of every member for one sample, by the member's name.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
        """
        return {name: member.predict(views) for name, member in self.members.items()}

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Returns the outputs of all members for a batch, or their losses if `targets` are given, named
        `<member>/<name>`.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            targets: the B samples with their ground truth; None for outputs.
        """
        return {
            f"{name}/{key}": value
            for name, member in self.members.items()
            for key, value in member.forward(views, targets).items()
        }

    def taps(self) -> Mapping[str, nn.Module]:
        """The tapped layers of all members (layers with readable feature maps), named `<member>/<name>`."""
        return {f"{name}/{key}": tap for name, member in self.members.items() for key, tap in member.taps().items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class DefenseWeights:
    """Weights of the two terms by which an adaptive attack also fools the defense; 0 leaves a term out.

    Attributes:
        score: weight of the term that lowers the defense's score.
        mask: weight of the term that removes the defense's mask from the patch.
    """

    score: float = 1.0
    mask: float = 1.0


USUAL_WEIGHTS = DefenseWeights()


class Defended(nn.Module):
    """A model in front of which a defense cleans the pictures, for attacks that know the defense (adaptive
    attacks).

    Attributes:
        device: name of the device of the model before `wrap`.
        weights: weights of the terms that lower the defense's score and mask.

    Args:
        model: the model as the defense's `wrap` returned it.
        defense: the defense.
        bare: the model before `wrap`, if the defense changes it; its networks are attacked as well.
        clean: function that cleans batches; None for the defense's `forward`.
        detect: function that cleans batches and also returns scores and masks; it replaces `clean`.
        weights: weights of the terms that lower the defense's score and mask.
        calibrate: function that calibrates the defense; the method `calibrate` calls it.
    """

    def __init__(
        self,
        model: Model,
        defense: Defense,
        bare: Model | None = None,
        clean: CleansBatches | None = None,
        *,
        detect: DefendsBatches | None = None,
        weights: DefenseWeights = USUAL_WEIGHTS,
        calibrate: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__()
        self.model, self.defense, self.weights, self.calibrate = model, defense, weights, calibrate
        clean = defense.forward if clean is None else clean
        self._defend = detect or (lambda views: DefendedBatch(views=clean(views)))
        self._last: tuple[Mapping[str, Tensor], bool, DefendedBatch] | None = None
        self.device = device_name(model if bare is None else bare)
        inside = [model] if bare is None or bare is model else [bare, model]
        self.networks = _networks(*(one for one in inside if one is not model or not isinstance(one, nn.Module)))

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """Returns the model's prediction for pictures of one sample, which are not cleaned by the defense.

        Attacks use `forward`, which cleans the pictures.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
        """
        return self.model.predict(views)

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Returns the model's outputs by name, or its losses if `targets` are given, on the cleaned pictures.

        Gradients pass the defense as its spec declares.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            targets: the B samples with their ground truth; None for outputs.
        """
        return self.model.forward(self.defended(views).views, targets)

    def defended(self, views: Mapping[str, Tensor]) -> DefendedBatch:
        """Returns the cleaned pictures of a batch, with the defense's scores and masks if any.

        The last result is kept with its autograd graph, so that outputs and terms of one step clean the pictures only
        once.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
        """
        has_gradients = torch.is_grad_enabled()
        if self._last is None or self._last[0] is not views or self._last[1] != has_gradients:
            self._last = (views, has_gradients, self._defend(views))
        return self._last[2]

    def taps(self) -> Mapping[str, nn.Module]:
        """The tapped layers of the model (layers with readable feature maps), by name."""
        return self.model.taps()


class Cleaned(Defended):
    """A model in front of which a defense without gradients cleans the pictures, for attacks that need no
    gradients.

    The defense receives uint8 pictures, one sample at a time.

    Args:
        model: the model as the defense's `wrap` returned it.
        defense: the defense.
        bare: the model before `wrap`.
        clean: function that cleans the (H, W, 3) uint8 pictures of one sample, by camera name.
        calibrate: function that calibrates the defense; the method `calibrate` calls it.
    """

    def __init__(
        self,
        model: Model,
        defense: Defense,
        bare: Model,
        clean: Callable[[Mapping[str, UInt8Image]], Mapping[str, UInt8Image]],
        calibrate: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__(model, defense, bare, partial(_cleaned_as_bytes, clean), calibrate=calibrate)

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Returns the model's outputs by name, or its losses if `targets` are given, on the cleaned pictures; no
        gradients.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1; they are rounded to bytes.
            targets: the B samples with their ground truth; None for outputs.
        """
        with torch.no_grad():
            return super().forward(views, targets)


def _cleaned_as_bytes(
    clean: Callable[[Mapping[str, UInt8Image]], Mapping[str, UInt8Image]], views: Mapping[str, Tensor]
) -> Mapping[str, Tensor]:
    """Cleans (B, 3, H, W) pictures in 0..1 one sample at a time, as uint8 pictures and without gradients."""
    given = {name: as_bytes(batch) for name, batch in views.items()}
    count = len(next(iter(given.values())))
    cleaned = [clean({name: batch[i] for name, batch in given.items()}) for i in range(count)]
    seen = {}
    for name, batch in views.items():
        pictures = torch.from_numpy(np.stack([one[name] for one in cleaned])).permute(0, 3, 1, 2)
        seen[name] = pictures.to(batch.device, batch.dtype) / 255
    return seen


def _networks(*models: Model) -> nn.ModuleList:
    """The torch modules inside the models as one list, so that modules of models that are no modules are frozen too."""
    return nn.ModuleList([network for model in models for _, network in networks_of(model)])


def device_name(model: Model) -> str:
    """Returns the name of a model's device, such as `cuda:0`; `cpu` if the model has no attribute `device`.

    Args:
        model: any model.
    """
    return str(getattr(model, "device", "cpu"))


def members_of(model: Model) -> Mapping[str, Model]:
    """Returns the attacked models by the prefix of their term names: `<member>/` in a group, "" for a single
    model.

    Args:
        model: a model or a `Group`.
    """
    if isinstance(model, Group):
        return {f"{name}/": member for name, member in model.members.items()}
    return {"": model}
