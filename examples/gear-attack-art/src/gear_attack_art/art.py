"""The toolbox attacks an "estimator" whose input are the patches: gear's compositor and the model lie behind it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from art.attacks.evasion import MomentumIterativeMethod, ProjectedGradientDescent
from art.estimators import BaseEstimator, LossGradientsMixin
from gear.contracts.attacks import Budget, Compositor, Monitor, Patch
from gear.contracts.models import Model

if TYPE_CHECKING:
    from gear_attack_art import ArtConfig

METHODS = {"pgd": ProjectedGradientDescent, "mim": MomentumIterativeMethod}


class PatchEstimator(LossGradientsMixin, BaseEstimator):  # type: ignore[misc]
    """What the toolbox needs of a model: the gradient of a loss. Its input are (surfaces, 3, h, w) patches in 0..1."""

    estimator_params = BaseEstimator.estimator_params

    def __init__(
        self, model: Model, dataset: Sequence[Any], compositor: Compositor, batch: int, rng: np.random.Generator
    ) -> None:
        super().__init__(model=model, clip_values=(0.0, 1.0))
        self._parts = (model, dataset, compositor)
        self._batch, self._rng = min(batch, len(dataset)), rng

    def loss_gradient(self, x: np.ndarray, y: Any, **kwargs: Any) -> np.ndarray:
        """Gradient of the model's losses on a few samples with respect to the patches, of the patches' shape."""
        model, dataset, compositor = self._parts
        chosen = sorted(self._rng.choice(len(dataset), self._batch, replace=False).tolist())
        patches = torch.from_numpy(np.asarray(x, np.float32)).requires_grad_(True)
        pictures = {view: compositor.compose(list(patches), chosen, view) for view in dataset[0].images}
        losses = model.forward(pictures, [dataset[index] for index in chosen])
        (gradient,) = torch.autograd.grad(torch.stack(list(losses.values())).sum(), patches)
        return np.asarray(gradient.numpy())

    def predict(self, x: np.ndarray, **kwargs: Any) -> np.ndarray:
        """The patches have no label of their own."""
        return np.zeros((len(x), 1), np.float32)

    def fit(self, x: np.ndarray, y: Any, **kwargs: Any) -> None:
        """Not available: the estimator is never trained.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("the attacked model is never trained")

    @property
    def input_shape(self) -> tuple[int, ...]:
        """Shape of one patch: (3, h, w)."""
        return (3, -1, -1)


class ArtAttack:
    """Runs one of the toolbox's attacks for as many iterations as there are steps in the budget."""

    def __init__(self, config: ArtConfig) -> None:
        self.config = config

    def optimise(
        self,
        model: Model,
        dataset: Sequence[Any],
        compositor: Compositor,
        *,
        budget: Budget,
        rng: np.random.Generator,
        monitor: Monitor | None = None,
    ) -> tuple[Patch, ...]:
        """One patch for each surface, starting from random values; the toolbox draws nothing and reports nothing in
        between.
        """
        config, count = self.config, len(dataset[0].record.surfaces)
        start = rng.uniform(0, 1, (count, 3, config.height_px, config.width_px)).astype(np.float32)
        attack = METHODS[config.method](
            PatchEstimator(model, dataset, compositor, config.batch, rng),
            norm=np.inf,
            eps=config.eps_unit,
            eps_step=min(config.step_unit, config.eps_unit),
            max_iter=budget.steps,
            batch_size=count,
            verbose=False,
        )
        patches = np.clip(attack.generate(start, y=np.zeros((count, 1), np.float32)), 0, 1)
        rgb = np.ascontiguousarray(patches.transpose(0, 2, 3, 1), np.float32)
        return tuple(Patch(name=f"patch_{n}", rgb=one) for n, one in enumerate(rgb))
