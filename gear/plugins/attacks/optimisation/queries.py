"""The objective of black-box attacks: computes the attack objective by forward passes alone, and counts them
against the query budget.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from gear.contracts.attacks import Budget, Compositor, HarmObjective, Objective, Patch, State
from gear.contracts.models import Model
from gear.plugins.attacks.optimisation.checkpoint_state import check_saved
from gear.plugins.attacks.optimisation.model_group import members_of
from gear.plugins.attacks.optimisation.objectives import counted, not_finite
from gear.values.errors import GearError

Textures = npt.NDArray[np.float32]
"""Textures of all surfaces, (S, 3, h, w) in 0..1."""


class BlackBoxObjective:
    """Computes the harm of textures and counts queries. One query is one forward pass of one model on a batch.

    Objectives that need the output on the picture without the patch (`needs_clean_output`) cost one more query for each
    new sample.

    Attributes:
        left: number of remaining queries.

    Args:
        model: the attacked model, or a group of models.
        dataset: samples of the scene.
        compositor: renderer of patches into the pictures of these samples.
        objective: the harm that is computed.
        budget: its `queries` is the number of queries; it must not be None.
    """

    def __init__(
        self, model: Model, dataset: Sequence[Any], compositor: Compositor, objective: Objective, budget: Budget
    ) -> None:
        self._model, self._dataset, self._compositor, self._objective = model, dataset, compositor, objective
        if budget.queries is None:
            raise GearError("an attack without gradients is counted in forward passes: say how many with --queries N")
        self.left = budget.queries
        self._seen: set[int] = set()

    def state(self) -> State:
        """Arrays for a checkpoint: the remaining queries, and the samples whose output without patch was counted."""
        return {"left": np.array(self.left), "paid": np.array(sorted(self._seen), np.int64)}

    def restore(self, state: State) -> None:
        """Restores the number of queries and the counted samples from a checkpoint.

        Args:
            state: checkpoint that contains the arrays of `state`.

        Raises:
            GearError: the checkpoint lacks these arrays, or they are damaged.
        """
        check_saved(state, {"left": np.array(0), "paid": np.zeros(np.size(state.get("paid", ())), np.int64)})
        self.left, self._seen = int(state["left"]), {int(index) for index in state["paid"]}

    def cost(self, indices: Sequence[int]) -> int:
        """Returns the number of queries that one evaluation of the harm costs.

        Args:
            indices: indices of the samples in the dataset.
        """
        asks = isinstance(self._objective, HarmObjective) and self._objective.needs_clean_output
        clean = len(set(indices) - self._seen) if asks else 0
        return len(members_of(self._model)) * (1 + clean)

    def harm(self, textures: Textures, indices: Sequence[int]) -> float:
        """Returns the harm of textures on some samples as one number, from forward passes without gradients;
        `left` falls by `cost`.

        Args:
            textures: (S, 3, h, w) in 0..1, one texture for each surface.
            indices: indices of the samples in the dataset.

        Raises:
            RuntimeError: fewer queries are left than the evaluation costs.
            GearError: the harm is not finite.
        """
        cost = self.cost(indices)
        if self.left < cost:
            raise RuntimeError("no queries left")
        self.left -= cost
        self._seen.update(indices)
        patches = [torch.from_numpy(np.ascontiguousarray(texture)) for texture in textures]
        samples = [self._dataset[index] for index in indices]
        with torch.no_grad():
            views = {view: self._compositor.compose(patches, indices, view) for view in samples[0].images}
            harm = sum(map(float, counted(self._objective, self._model, views, samples, indices)))
        if not math.isfinite(harm):
            raise not_finite("the objective", indices)
        return harm


def as_patches(textures: Textures) -> tuple[Patch, ...]:
    """Converts textures to patches named `patch_0`, `patch_1`, …, one for each surface.

    Args:
        textures: (S, 3, h, w) in 0..1.
    """
    rgb = np.ascontiguousarray(textures.transpose(0, 2, 3, 1), np.float32)
    return tuple(Patch(name=f"patch_{n}", rgb=one) for n, one in enumerate(rgb))
