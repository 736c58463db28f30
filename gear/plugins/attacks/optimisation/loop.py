"""The optimisation of textures: Adam along an ascent direction that the attack chooses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.contracts.attacks import Budget, Compositor, Objective, Patch, State, Watch
from gear.contracts.models import Model
from gear.plugins.attacks.optimisation.appearance import vary
from gear.plugins.attacks.optimisation.checkpoint_state import check_saved
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.model_group import members_of
from gear.plugins.attacks.optimisation.objectives import all_terms, not_finite
from gear.plugins.attacks.optimisation.regularisers import non_printability, smoothness
from gear.plugins.attacks.optimisation.settings import Settings, TextureSettings
from gear.values.errors import GearError
from gear.values.rng import derive_rng

BETAS, EPSILON = (0.9, 0.999), 1e-8

NO_GRADIENT = (
    "no gradient reaches the patch: it is seen in no sample, nothing is left to be harmed, or the model passes none "
    "(gear plugins show MODEL says whether it has gradients)"
)


ARRAYS, NUMBERS = ("textures", "mean", "square"), ("done", "seed", "felt", "silent")
"""What a checkpoint holds."""


class TextureOptimiser:
    """Textures, Adam's moments, the number of steps done and what was felt: all that must be kept to go on later.

    Attributes:
        felt: whether any gradient has reached the textures.
        silent: steps since the last one did.
    """

    def __init__(self, surfaces: int, settings: TextureSettings, rng: np.random.Generator, saved: State | None) -> None:
        shape = (surfaces, 3, settings.height_px, settings.width_px)
        self.rate = torch.as_tensor(settings.rate, dtype=torch.float32).reshape(-1, 1, 1)
        if saved is None:
            self.textures = torch.from_numpy(rng.uniform(0, 1, shape).astype(np.float32))
            self.mean, self.square = torch.zeros(shape), torch.zeros(shape)
            self.done, self.seed = 0, int(rng.integers(2**62))
            self.felt, self.silent = False, 0
            return
        blank, number = np.broadcast_to(np.float32(0), shape), np.array(0)
        check_saved(saved, dict.fromkeys(ARRAYS, blank) | dict.fromkeys(NUMBERS, number))
        self.textures, self.mean, self.square = (torch.from_numpy(saved[n].copy()) for n in ARRAYS)
        self.done, self.seed = int(saved["done"]), int(saved["seed"])
        self.felt, self.silent = bool(saved["felt"]), int(saved["silent"])

    def feel(self, gradient: float | None) -> None:
        """Takes note of how long a step's gradient was; None where nothing was left to be harmed."""
        self.silent = self.silent + 1 if gradient == 0 else 0
        self.felt |= (gradient or 0.0) > 0

    def step(self, ascent: Tensor, share: float) -> None:
        """One Adam step along the gradient, with `share` of the learning rate; textures stay in 0..1."""
        self.done += 1
        self.mean.lerp_(ascent, 1 - BETAS[0])
        self.square.lerp_(ascent.square(), 1 - BETAS[1])
        mean = self.mean / (1 - BETAS[0] ** self.done)
        square = self.square / (1 - BETAS[1] ** self.done)
        self.textures = (self.textures + share * self.rate * mean / (square.sqrt() + EPSILON)).clamp(0, 1)

    def patches(self) -> tuple[Patch, ...]:
        """As they are now."""
        rgb = self.textures.permute(0, 2, 3, 1).contiguous().numpy()
        return tuple(Patch(name=f"patch_{n}", rgb=one.copy()) for n, one in enumerate(rgb))

    def state(self) -> State:
        """To resume from."""
        arrays = {name: getattr(self, name).numpy().copy() for name in ARRAYS}
        numbers = {name: np.int64(getattr(self, name)) for name in NUMBERS}
        return {**arrays, **numbers}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Problem:
    """What is attacked, with what, seen how.

    Attributes:
        model, dataset, compositor: as `Attack.optimise` is given them.
        settings: of the optimisation.
    """

    model: Model
    dataset: Sequence[Any]
    compositor: Compositor
    settings: TextureSettings

    def surfaces(self) -> int:
        """How many patches there are.

        Raises:
            GearError: none, so there is nothing to attack.
        """
        count = len(self.dataset[0].record.surfaces) if len(self.dataset) else 0
        if not count:
            raise GearError("nothing to attack: the dataset has no sample with a patch surface")
        return count

    def seen(self, textures: Tensor, indexes: Sequence[int], step: int, seed: int) -> Seen:
        """Pictures of some samples; both eyes see the same look of a patch, every sample another one."""
        samples = [self.dataset[index] for index in indexes]
        looks = []
        for index in indexes:
            rng = derive_rng(seed, "appearance", step, index)
            looks.append([vary(self.settings.appearance, texture, rng) for texture in textures])
        batches = [torch.stack(patches) for patches in zip(*looks, strict=True)]
        views = {view: self.compositor.compose(batches, indexes, view) for view in samples[0].images}
        return Seen(views=views, samples=samples, indexes=indexes)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Seen:
    """A batch with the patches in it.

    Attributes:
        views: (B, 3, H, W) pictures by camera name, differentiable to the textures.
        samples: their samples.
        indexes: their numbers in the data set.
    """

    views: Mapping[str, Tensor]
    samples: Sequence[Any]
    indexes: Sequence[int]


Ascend = Callable[[Tensor, Seen], tuple[Tensor, dict[str, float]]]
"""From (S, 3, h, w) textures that ask for gradients and a batch with them in it: the direction to go, and values,
among them `gradient`, the length of the objective's gradient, unless nothing is left to be harmed."""


def climb(
    problem: Problem,
    ascend: Ascend,
    *,
    budget: Budget,
    rng: np.random.Generator,
    watch: Watch | None = None,
    before: Callable[[int], None] | None = None,
) -> tuple[Patch, ...]:
    """Textures for every surface of the data set, optimised jointly.

    Args:
        problem: what is attacked.
        ascend: says where to go.
        budget: how many steps.
        rng: where all chance comes from.
        watch: told of every step.
        before: called with the number of steps done before each.

    Raises:
        GearError: no gradient of the objective reaches the textures or one is not finite, or there is nothing to
            attack.
    """
    settings, count = problem.settings, len(problem.dataset)
    saved = watch.resume() if watch is not None else None
    optimiser = TextureOptimiser(problem.surfaces(), settings, rng, saved)
    begun = optimiser.done
    with frozen(problem.model):
        while optimiser.done < budget.steps:
            done = optimiser.done
            if before is not None:
                before(done)
            indexes = batch_of(done, count, settings.batch, optimiser.seed)
            textures = optimiser.textures.clone().requires_grad_(True)
            direction, values = ascend(textures, problem.seen(textures, indexes, done, optimiser.seed))
            if not bool(direction.isfinite().all()):
                raise not_finite(f"the gradient of step {done + 1}", indexes)
            optimiser.feel(values.get("gradient"))
            if optimiser.silent * settings.batch >= 2 * count + settings.batch:
                raise GearError(NO_GRADIENT)
            share = 0.5 * (1 + math.cos(math.pi * done / budget.steps)) if settings.decay else 1.0
            optimiser.step(direction, share)
            if watch is not None and watch.step(optimiser.done, values, optimiser.patches, optimiser.state):
                break
    if optimiser.done > begun and not optimiser.felt:
        raise GearError(NO_GRADIENT)
    return optimiser.patches()


def batch_of(step: int, count: int, size: int, seed: int) -> list[int]:
    """Sample numbers of a step: every epoch is a permutation of its own; the same whether resumed or not."""
    size = min(size, count)
    steps_per_epoch = count // size
    epoch, place = divmod(step, steps_per_epoch)
    order = derive_rng(seed, "order", epoch).permutation(count)
    return [int(index) for index in order[place * size : (place + 1) * size]]


def unit_gradients(problem: Problem, objective: Objective, settings: Settings) -> Ascend:
    """The scene-specific attack's direction: one gradient a term, each of unit length, less the regularisers'."""

    def ascend(textures: Tensor, seen: Seen) -> tuple[Tensor, dict[str, float]]:
        terms = {
            prefix + name: term
            for prefix, member in members_of(problem.model).items()
            for name, term in all_terms(objective, member, seen.views, seen.samples, seen.indexes).items()
        }
        values = {name: float(term.value.detach()) for name, term in terms.items()}
        total = torch.zeros_like(textures)
        if settings.per_term:
            for number, term in enumerate(terms.values()):
                total += term.weight * unit(gradient_to(term.value, textures, keep=number + 1 < len(terms)))
        elif terms:
            total += gradient_to(torch.stack([t.weight * t.value for t in terms.values()]).sum(), textures)
        if terms:
            values["gradient"] = float(total.norm())
        total = unit(total)
        for name, weight in (("smoothness", settings.smoothness), ("printability", settings.printability)):
            if weight:
                penalty = torch.stack([REGULARISERS[name](one) for one in textures]).sum()
                values[name] = float(penalty.detach())
                total -= weight * unit(gradient_to(penalty, textures))
        return total, values

    return ascend


REGULARISERS = {"smoothness": smoothness, "printability": non_printability}


def one_gradient(
    value: Callable[[Tensor, Seen], Mapping[str, Tensor]],
    penalties: Callable[[Tensor], Mapping[str, Tensor]] | None = None,
) -> Ascend:
    """The direction of attacks that add everything up: the gradient of the sum of named numbers, as it is.

    Args:
        value: of the textures and a batch; no number where nothing is left to be harmed.
        penalties: numbers more, of the textures alone, whose gradient is none of the objective's: there is one even
            where nobody sees the patch.
    """

    def ascend(textures: Tensor, seen: Seen) -> tuple[Tensor, dict[str, float]]:
        parts = value(textures, seen)
        others = {} if penalties is None else penalties(textures)
        values = {name: float(part.detach()) for name, part in {**parts, **others}.items()}
        gradient = torch.zeros_like(textures)
        if parts:
            gradient = gradient_to(torch.stack(list(parts.values())).sum(), textures)
            values["gradient"] = float(gradient.norm())
        if others:
            gradient = gradient + gradient_to(torch.stack(list(others.values())).sum(), textures)
        return gradient, values

    return ascend


def unit(gradient: Tensor) -> Tensor:
    """At length 1 over everything; as it is where it is 0."""
    norm = gradient.norm()
    return gradient / norm if norm > 0 else gradient


def gradient_to(value: Tensor, textures: Tensor, *, keep: bool = False) -> Tensor:
    """The gradient of a number; zeros where none flows."""
    if not value.requires_grad:
        return torch.zeros_like(textures)
    (gradient,) = torch.autograd.grad(value, textures, retain_graph=keep, allow_unused=True)
    return torch.zeros_like(textures) if gradient is None else gradient.detach()
