"""The optimisation loop for textures: Adam along an ascent direction that the attack chooses, on the textures' values
or on the parameters from which the textures are computed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.contracts.attacks import Budget, Compositor, Monitor, Objective, Patch, State
from gear.contracts.models import Model
from gear.plugins.attacks.optimisation.appearance import vary
from gear.plugins.attacks.optimisation.checkpoint_state import check_saved
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.member_weights import balanced
from gear.plugins.attacks.optimisation.model_group import members_of
from gear.plugins.attacks.optimisation.objectives import all_terms, not_finite
from gear.plugins.attacks.optimisation.parametrisation import Parametrisation, Pixels
from gear.plugins.attacks.optimisation.regularisers import non_printability, smoothness
from gear.plugins.attacks.optimisation.settings import Settings, TextureSettings
from gear.values.errors import GearError
from gear.values.rng import derive_rng

BETAS, EPSILON = (0.9, 0.999), 1e-8

NO_GRADIENT = (
    "no gradient reaches the patch: it is seen in no sample, nothing is left to be harmed, or the model passes none "
    "(gear plugins show MODEL says whether it has gradients)"
)


ARRAYS, NUMBERS = ("parameters", "mean", "square"), ("done", "seed", "has_gradient", "steps_without")
"""Names of the arrays and of the numbers in a checkpoint."""


class TextureOptimiser:
    """The state of a texture optimisation: parameters, Adam's moments, and the number of completed steps.

    `state` returns all arrays and numbers from which an interrupted optimisation can be resumed.

    Attributes:
        parametrisation: computes the textures from the parameters.
        parameters: (S, 3, ...) float32; the textures themselves with the parametrisation `Pixels`.
        mean, square: running means of the gradient and of its square, of the parameters' shape.
        rate: peak learning rate, a scalar or (3, 1, 1).
        done: number of completed steps.
        seed: seed of the run's further random draws.
        has_gradient: whether any gradient other than zero has reached the textures.
        steps_without: number of successive steps whose gradient was zero, up to now.

    Args:
        surfaces: number S of patch surfaces.
        settings: size of the patches, and the learning rate.
        rng: generator of the first parameters and of the seed; not used with a saved state.
        saved: result of an earlier `state`, to resume from; None to start anew.
        parametrisation: computes the textures from the parameters; None for free pixels.
    """

    def __init__(
        self,
        surfaces: int,
        settings: TextureSettings,
        rng: np.random.Generator,
        saved: State | None,
        parametrisation: Parametrisation | None = None,
    ) -> None:
        self.parametrisation = parametrisation or Pixels(settings.height_px, settings.width_px)
        shape = self.parametrisation.shape(surfaces)
        self.rate = torch.as_tensor(settings.rate, dtype=torch.float32).reshape(-1, 1, 1)
        if saved is None:
            self.parameters = self.parametrisation.first(surfaces, rng)
            self.mean, self.square = torch.zeros(shape), torch.zeros(shape)
            self.done, self.seed = 0, int(rng.integers(2**62))
            self.has_gradient, self.steps_without = False, 0
            return
        blank, number = np.broadcast_to(np.float32(0), shape), np.array(0)
        check_saved(saved, dict.fromkeys(ARRAYS, blank) | dict.fromkeys(NUMBERS, number))
        self.parameters, self.mean, self.square = (torch.from_numpy(saved[n].copy()) for n in ARRAYS)
        self.done, self.seed = int(saved["done"]), int(saved["seed"])
        self.has_gradient, self.steps_without = bool(saved["has_gradient"]), int(saved["steps_without"])

    def note_gradient(self, gradient: float | None) -> None:
        """Records the length of the objective's gradient in a step, in `has_gradient` and `steps_without`.

        Args:
            gradient: length of the gradient; None if nothing could be harmed in the step.
        """
        self.steps_without = self.steps_without + 1 if gradient == 0 else 0
        self.has_gradient |= (gradient or 0.0) > 0

    def step(self, ascent: Tensor, share: float) -> None:
        """Changes the parameters by one Adam step along a direction and projects them onto the allowed ones; `done`
        rises by 1.

        Args:
            ascent: direction in which the parameters are changed, of their shape.
            share: factor on the learning rate, 0..1.
        """
        self.done += 1
        self.mean.lerp_(ascent, 1 - BETAS[0])
        self.square.lerp_(ascent.square(), 1 - BETAS[1])
        mean = self.mean / (1 - BETAS[0] ** self.done)
        square = self.square / (1 - BETAS[1] ** self.done)
        moved = self.parameters + share * self.rate * mean / (square.sqrt() + EPSILON)
        self.parameters = self.parametrisation.projected(moved)

    def patches(self) -> tuple[Patch, ...]:
        """The current textures as patches, one for each surface."""
        textures = self.parametrisation.textures(self.parameters)
        rgb = textures.permute(0, 2, 3, 1).contiguous().numpy()
        return tuple(Patch(name=f"patch_{n}", rgb=one.copy()) for n, one in enumerate(rgb))

    def state(self) -> State:
        """The arrays and numbers, by name, from which the optimisation can be resumed."""
        arrays = {name: getattr(self, name).numpy().copy() for name in ARRAYS}
        numbers = {name: np.int64(getattr(self, name)) for name in NUMBERS}
        return {**arrays, **numbers}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Problem:
    """The arguments of a texture optimisation: a model, samples, the compositor and the settings.

    Attributes:
        model, dataset, compositor: the attacked model, the samples, and the renderer of patches into their pictures.
        settings: settings of the optimisation.
    """

    model: Model
    dataset: Sequence[Any]
    compositor: Compositor
    settings: TextureSettings

    def surfaces(self) -> int:
        """The number of patch surfaces in the scene, each of which gets a patch.

        Raises:
            GearError: the dataset has no sample with a patch surface.
        """
        count = len(self.dataset[0].record.surfaces) if len(self.dataset) else 0
        if not count:
            raise GearError("nothing to attack: the dataset has no sample with a patch surface")
        return count

    def compose_batch(self, textures: Tensor, indices: Sequence[int], step: int, seed: int) -> PatchedBatch:
        """Returns a batch of samples with the textures composed into their pictures.

        Changes of the patch's appearance are drawn for each sample; they are the same in both views of a stereo pair.

        Args:
            textures: (S, 3, h, w) in 0..1, one texture for each surface.
            indices: indices of the samples in the dataset.
            step: number of the step, on which the random draws depend.
            seed: seed of the random draws.
        """
        samples = [self.dataset[index] for index in indices]
        looks = []
        for index in indices:
            rng = derive_rng(seed, "appearance", step, index)
            looks.append([vary(self.settings.appearance, texture, rng) for texture in textures])
        batches = [torch.stack(patches) for patches in zip(*looks, strict=True)]
        views = {view: self.compositor.compose(batches, indices, view) for view in samples[0].images}
        return PatchedBatch(views=views, samples=samples, indices=indices)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PatchedBatch:
    """A batch of samples with pictures into which the textures were composed.

    Attributes:
        views: (B, 3, H, W) pictures in 0..1 by camera name, differentiable with respect to the textures.
        samples: the samples of the batch.
        indices: indices of the samples in the dataset.
    """

    views: Mapping[str, Tensor]
    samples: Sequence[Any]
    indices: Sequence[int]


Direction = Callable[[Tensor, PatchedBatch], tuple[Tensor, dict[str, float]]]
"""A function that computes an ascent direction.

It takes (S, 3, h, w) textures that require gradients, and a batch of pictures with these textures. It returns the
direction, with the shape of the textures, and scalars for the training curves. The scalars contain `gradient`, the
length of the objective's gradient, unless nothing in the batch can be harmed any more.
"""


def optimise_textures(
    problem: Problem,
    ascend: Direction,
    *,
    budget: Budget,
    rng: np.random.Generator,
    monitor: Monitor | None = None,
    before: Callable[[int], None] | None = None,
    parametrisation: Parametrisation | None = None,
) -> tuple[Patch, ...]:
    """Optimises the textures of all patch surfaces together with Adam, and returns them as patches.

    Args:
        problem: model, samples, compositor and settings.
        ascend: computes the ascent direction.
        budget: largest number of steps.
        rng: generator of all random choices.
        monitor: called after every step; it can end the run and provide a saved state to start from.
        before: called before every step with the number of completed steps.
        parametrisation: computes the textures from the optimised parameters; None for free pixels.

    Returns:
        Patches named `patch_0`, `patch_1`, …, in the order of the scene's surfaces.

    Raises:
        GearError: no gradient of the objective reaches the textures, a gradient is not finite, or there is nothing to
            attack.
    """
    settings, count = problem.settings, len(problem.dataset)
    saved = monitor.resume() if monitor is not None else None
    optimiser = TextureOptimiser(problem.surfaces(), settings, rng, saved, parametrisation)
    begun = optimiser.done
    with frozen(problem.model):
        while optimiser.done < budget.steps:
            done = optimiser.done
            if before is not None:
                before(done)
            indices = batch_of(done, count, settings.batch, optimiser.seed)
            parameters = optimiser.parameters.clone().requires_grad_(True)
            shown = optimiser.parametrisation.textures(parameters)
            textures = shown.detach().clone().requires_grad_(True)
            direction, values = ascend(textures, problem.compose_batch(textures, indices, done, optimiser.seed))
            if not bool(direction.isfinite().all()):
                raise not_finite(f"the gradient of step {done + 1}", indices)
            optimiser.note_gradient(values.get("gradient"))
            if optimiser.steps_without * settings.batch >= 2 * count + settings.batch:
                raise GearError(NO_GRADIENT)
            share = 0.5 * (1 + math.cos(math.pi * done / budget.steps)) if settings.decay else 1.0
            (ascent,) = torch.autograd.grad(shown, parameters, direction)
            optimiser.step(ascent, share)
            if monitor is not None and monitor.step(optimiser.done, values, optimiser.patches, optimiser.state):
                break
    if optimiser.done > begun and not optimiser.has_gradient:
        raise GearError(NO_GRADIENT)
    return optimiser.patches()


def batch_of(step: int, count: int, size: int, seed: int) -> list[int]:
    """Returns the indices of the samples that one step of an attack uses.

    Every epoch has another permutation of the samples. The indices depend only on the arguments, so a resumed run has
    the same batches.

    Args:
        step: number of the step, from 0.
        count: number of samples in the dataset.
        size: number of samples per step; at most `count` are returned.
        seed: seed of the permutations.
    """
    size = min(size, count)
    steps_per_epoch = count // size
    epoch, place = divmod(step, steps_per_epoch)
    order = derive_rng(seed, "order", epoch).permutation(count)
    return [int(index) for index in order[place * size : (place + 1) * size]]


def unit_gradients(problem: Problem, objective: Objective, settings: Settings, *, focus: float = 0.0) -> Direction:
    """Makes the ascent direction of the scene-specific attack, from the objective's and the regularisers'
    gradients.

    The gradient of each term is scaled to length 1 (with `per_term`) and multiplied by the term's weight; the sum is
    scaled to length 1 again. The gradients of the regularisers, scaled to the lengths in the settings, are subtracted.
    With several networks and a `focus`, terms are also weighted by network (`balanced`).

    Args:
        problem: the attacked model or group, whose defenses add terms of their own.
        objective: objective of the attack, a sum of weighted terms.
        settings: lengths of the regularisers' gradients, and `per_term`.
        focus: with several networks, how strongly those that are harmed least are favoured; 0 treats all alike.
    """

    def ascend(textures: Tensor, batch: PatchedBatch) -> tuple[Tensor, dict[str, float]]:
        by_member = {
            prefix: all_terms(objective, member, batch.views, batch.samples, batch.indices)
            for prefix, member in members_of(problem.model).items()
        }
        terms = balanced(by_member, focus)
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
    value: Callable[[Tensor, PatchedBatch], Mapping[str, Tensor]],
    penalties: Callable[[Tensor], Mapping[str, Tensor]] | None = None,
) -> Direction:
    """Makes the ascent direction of attacks with a single loss: the unscaled gradient of the sum of some scalars.

    Args:
        value: function from textures (S, 3, h, w) and a batch to the objective's scalars by name; it returns an empty
            mapping if nothing in the batch can be harmed any more.
        penalties: function from textures to further scalars by name; None for none. Their gradients exist even if no
            picture contains the patch, so they do not count as gradients of the objective.
    """

    def ascend(textures: Tensor, batch: PatchedBatch) -> tuple[Tensor, dict[str, float]]:
        parts = value(textures, batch)
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
    """Returns a tensor divided by its length (2-norm over all values); a tensor of zeros is returned unchanged.

    Args:
        gradient: tensor of any shape.
    """
    norm = gradient.norm()
    return gradient / norm if norm > 0 else gradient


def gradient_to(value: Tensor, textures: Tensor, *, keep: bool = False) -> Tensor:
    """The gradient of a scalar with respect to the textures; zeros if the scalar does not depend on the textures.

    Args:
        value: the scalar.
        textures: tensor that requires gradients.
        keep: whether the autograd graph is kept for another backward pass.
    """
    if not value.requires_grad:
        return torch.zeros_like(textures)
    (gradient,) = torch.autograd.grad(value, textures, retain_graph=keep, allow_unused=True)
    return torch.zeros_like(textures) if gradient is None else gradient.detach()
