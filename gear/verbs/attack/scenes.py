"""Samples with the compositor that puts patches into them, and the effect of patches on these samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.compositor.base import Prepared
from gear.compositor.cache import Cache
from gear.compositor.registry import open_compositor
from gear.contracts.attacks import Objective, Patch
from gear.contracts.models import Model
from gear.dataset.reading import Dataset
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.gradient_checks import predicted_and_measured_change
from gear.plugins.attacks.optimisation.model_group import Defended, members_of
from gear.plugins.attacks.optimisation.objectives import counted, defense_terms
from gear.readers import Kept, all_of
from gear.values.errors import GearError
from gear.verbs.attack.data import JoinedCompositor

RANDOM_PX = (32, 64)
"""Height and width in pixels of the random patches at which gradients are checked."""

PICTURES = "defense_pictures"
"""Name of the gradient of a defense's output pictures with respect to the patches."""

KEPT_BYTES = 2 << 30
SHOWN = 3
"""Number of samples in the checks of gradients."""


class Scenes:
    """The samples of an attack, with the compositor that puts patches into them."""

    def __init__(self, datasets: Sequence[Dataset[Any]], compositor: str, device: str, cache: Cache[Prepared]) -> None:
        """Joins the samples of several datasets and opens a compositor for each dataset.

        Args:
            datasets: datasets of the samples.
            compositor: name of the compositor, the method that puts patches into pictures.
            device: device of the compositor.
            cache: cache for the data that compositors precompute, shared by all datasets.
        """
        samples = all_of(tuple(datasets))
        self.samples = Kept(samples, KEPT_BYTES)
        self.compositor = JoinedCompositor(
            samples, [open_compositor(compositor, dataset, device=device, cache=cache) for dataset in datasets]
        )

    def harm(
        self, model: Model, objective: Objective, patches: Sequence[Patch], indices: Sequence[int] | None = None
    ) -> float:
        """Returns the mean objective over samples, with patches that are not randomly transformed; larger values mean
        more harm.

        Args:
            model: the attacked network.
            objective: the objective of the attack.
            patches: one patch per surface.
            indices: positions of the samples; None for all.
        """
        chosen = range(len(self.samples)) if indices is None else indices
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        with torch.no_grad(), frozen(model):
            values = [float(self.value(model, objective, tensors, [index])) for index in chosen]
        return float(np.mean(values))

    def value(self, model: Model, objective: Objective, patches: Sequence[Tensor], indices: Sequence[int]) -> Tensor:
        """Returns the mean objective over the samples in `indices` as a differentiable scalar.

        Args:
            model: the attacked network.
            objective: objective of the attack.
            patches: (3, h, w) each, in 0..1, one per surface.
            indices: indices of the samples.
        """
        samples = [self.samples[index] for index in indices]
        views = {view: self.compositor.compose(patches, indices, view) for view in samples[0].images}
        numbers = counted(objective, model, views, samples, indices)
        return torch.stack(numbers).sum() if numbers else torch.zeros(())

    def gradient_check(self, model: Model, objective: Objective, patches: Sequence[Patch]) -> tuple[float, float]:
        """Checks for masked gradients: takes a small step along the gradient of the objective with respect to the
        patches, on the first samples.

        Args:
            model: the attacked network, with its defense.
            objective: the objective of the attack.
            patches: one patch per surface; they are not changed.

        Returns:
            The change of the objective that the gradient predicts, and the change that the step really causes.
        """
        indices = list(range(min(SHOWN, len(self.samples))))
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        with frozen(model):
            return predicted_and_measured_change(
                lambda changed: self.value(model, objective, changed, indices), tensors
            )

    def check_adaptive(self, model: Model, surfaces: int, rng: np.random.Generator) -> None:
        """Checks that the pictures, scores and masks of the defenses have a gradient with respect to random
        patches.

        Args:
            model: the attacked network with its defenses.
            surfaces: number of surfaces, each of which gets a random patch.
            rng: random generator of the patches.

        Raises:
            GearError: one of these gradients is 0, so the attack would not be adaptive to the defense.
        """
        patches = [
            torch.from_numpy(rng.uniform(0.05, 0.95, (3, *RANDOM_PX)).astype(np.float32)) for _ in range(surfaces)
        ]
        is_seen = [any(one.visible_px for one in sample.surfaces) for sample in self.samples]
        for name, member in members_of(model).items():
            if not isinstance(member, Defended):
                continue
            sizes: dict[str, float] = {}
            with frozen(model):
                for index in np.flatnonzero(is_seen)[:SHOWN].tolist():
                    for term, size in self._gradients(member, patches, index).items():
                        sizes[term] = max(sizes.get(term, 0.0), size)
            for term in (term for term, size in sizes.items() if not size > 0):
                kind, of_model = term.removeprefix("defense_"), f" of {name[:-1]}" if name else ""
                if term == PICTURES:
                    raise GearError(
                        f"the pictures that the defense{of_model} returns have no gradient at random patches, so that "
                        "the attack would change nothing that the model sees; attacks that count queries need none "
                        "(--attack square with --queries N)"
                    )
                raise GearError(
                    f"the {kind} of the defense{of_model} has no gradient at random patches, so that the attack would "
                    f"not lower it; leave it out with --{kind}-weight 0"
                )

    def _gradients(self, member: Defended, patches: Sequence[Tensor], index: int) -> dict[str, float]:
        """Computes the gradients of a defense's outputs with respect to the patches in one sample.

        Returns:
            The largest absolute entry of the gradient, for each loss term of the defense and for a random projection of
            its pictures.
        """
        asked = [patch.clone().requires_grad_(True) for patch in patches]
        sample = self.samples[index]
        views = {view: self.compositor.compose(asked, [index], view) for view in sample.images}
        values = {name: term.value for name, term in defense_terms(member, views, [sample]).items()}
        # A plain sum or square would have no gradient behind a defense that normalises pictures.
        draws = torch.Generator().manual_seed(index)
        cleaned = member.defended(views).views.values()
        projections = [(one * torch.rand(one.shape, generator=draws).to(one)).sum() for one in cleaned]
        values[PICTURES] = torch.stack(projections).sum()
        sizes = {}
        for name, value in values.items():
            found: Sequence[Tensor | None] = ()
            if value.requires_grad:
                found = torch.autograd.grad(value, asked, retain_graph=True, allow_unused=True)
            sizes[name] = max((float(one.abs().max()) for one in found if one is not None), default=0.0)
        return sizes
