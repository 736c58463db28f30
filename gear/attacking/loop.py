"""The optimisation of the scene-specific attack: Adam on the textures, one unit gradient a term."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.attacking.appearance import vary
from gear.attacking.borrowed import frozen
from gear.attacking.group import members_of
from gear.attacking.objectives import Objective
from gear.attacking.regularisers import non_printability, smoothness
from gear.attacking.settings import Settings
from gear.contracts.attacks import Budget, Compositor, Patch, State, Watch
from gear.contracts.models import Model
from gear.values.errors import GearError
from gear.values.rng import derive_rng

BETAS, EPSILON = (0.9, 0.999), 1e-8


class TextureOptimiser:
    """Textures, Adam's moments and the number of steps done: all that must be kept to go on later."""

    def __init__(self, surfaces: int, settings: Settings, rng: np.random.Generator, saved: State | None) -> None:
        shape = (surfaces, 3, settings.height_px, settings.width_px)
        self.rate = torch.as_tensor(settings.learning_rate, dtype=torch.float32).reshape(-1, 1, 1)
        if saved is None:
            self.textures = torch.from_numpy(rng.uniform(0, 1, shape).astype(np.float32))
            self.mean, self.square = torch.zeros(shape), torch.zeros(shape)
            self.done, self.seed = 0, int(rng.integers(2**62))
            return
        if saved["textures"].shape != shape:
            raise GearError(f"the saved attack has patches of {saved['textures'].shape}, not {shape}; start it afresh")
        self.textures, self.mean, self.square = (
            torch.from_numpy(saved[n].copy()) for n in ("textures", "mean", "square")
        )
        self.done, self.seed = int(saved["done"]), int(saved["seed"])

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
        arrays = {name: getattr(self, name).numpy().copy() for name in ("textures", "mean", "square")}
        return {**arrays, "done": np.int64(self.done), "seed": np.int64(self.seed)}


def optimise(
    settings: Settings,
    objective: Objective,
    model: Model,
    dataset: Sequence[Any],
    compositor: Compositor,
    *,
    budget: Budget,
    rng: np.random.Generator,
    watch: Watch | None = None,
) -> tuple[Patch, ...]:
    """Textures for every surface of the data set, optimised jointly.

    Raises:
        GearError: no gradient of the objective reaches the textures, or there is nothing to attack.
    """
    surfaces = len(dataset[0].record.surfaces) if len(dataset) else 0
    if not surfaces:
        raise GearError("nothing to attack: the dataset has no sample with a patch surface")
    saved = watch.resume() if watch is not None else None
    optimiser = TextureOptimiser(surfaces, settings, rng, saved)
    silent = 0
    with frozen(model):
        while optimiser.done < budget.steps:
            done = optimiser.done
            indexes = batch_of(done, len(dataset), settings.batch, optimiser.seed)
            ascent, figures = _gradient(settings, objective, model, dataset, compositor, optimiser, indexes)
            silent = silent + 1 if figures.get("gradient") == 0 else 0
            if silent * settings.batch >= 2 * len(dataset) + settings.batch:
                raise GearError(
                    "no gradient reaches the patch: it is seen in no sample, or the model passes none "
                    "(gear plugins show MODEL says whether it has gradients)"
                )
            share = 0.5 * (1 + math.cos(math.pi * done / budget.steps)) if settings.decay else 1.0
            optimiser.step(ascent, share)
            if watch is not None and watch.step(optimiser.done, figures, optimiser.patches, optimiser.state):
                break
    return optimiser.patches()


def batch_of(step: int, count: int, size: int, seed: int) -> list[int]:
    """Sample numbers of a step: every epoch is a permutation of its own; the same whether resumed or not."""
    size = min(size, count)
    steps_per_epoch = count // size
    epoch, place = divmod(step, steps_per_epoch)
    order = derive_rng(seed, "order", epoch).permutation(count)
    return [int(index) for index in order[place * size : (place + 1) * size]]


def _gradient(
    settings: Settings,
    objective: Objective,
    model: Model,
    dataset: Sequence[Any],
    compositor: Compositor,
    optimiser: TextureOptimiser,
    indexes: Sequence[int],
) -> tuple[Tensor, dict[str, float]]:
    """The direction to go, and the step's figures."""
    textures = optimiser.textures.clone().requires_grad_(True)
    samples = [dataset[index] for index in indexes]
    views = compose(settings, compositor, textures, samples, indexes, optimiser)
    terms = {
        prefix + name: term
        for prefix, member in members_of(model).items()
        for name, term in objective.terms(member, views, samples, indexes).items()
    }
    figures = {name: float(term.value.detach()) for name, term in terms.items()}
    ascent = torch.zeros_like(textures)
    if settings.per_term:
        for number, term in enumerate(terms.values()):
            ascent += term.weight * unit(_to_textures(term.value, textures, keep=number + 1 < len(terms)))
    elif terms:
        ascent += _to_textures(torch.stack([t.weight * t.value for t in terms.values()]).sum(), textures, keep=False)
    if terms:
        figures["gradient"] = float(ascent.norm())
    ascent = unit(ascent)
    for name, weight in (("smoothness", settings.smoothness), ("printability", settings.printability)):
        if weight:
            penalty = torch.stack([REGULARISERS[name](one) for one in textures]).sum()
            figures[name] = float(penalty.detach())
            ascent -= weight * unit(torch.autograd.grad(penalty, textures)[0])
    return ascent, figures


REGULARISERS = {"smoothness": smoothness, "printability": non_printability}


def compose(
    settings: Settings,
    compositor: Compositor,
    textures: Tensor,
    samples: Sequence[Any],
    indexes: Sequence[int],
    optimiser: TextureOptimiser,
) -> Mapping[str, Tensor]:
    """Pictures with the textures in them; both eyes see the same look of a patch, every sample another."""
    looks = []
    for index in indexes:
        rng = derive_rng(optimiser.seed, "appearance", optimiser.done, index)
        looks.append([vary(settings.appearance, texture, rng) for texture in textures])
    batches = [torch.stack(textures) for textures in zip(*looks, strict=True)]
    return {view: compositor.compose(batches, indexes, view) for view in samples[0].images}


def unit(gradient: Tensor) -> Tensor:
    """At length 1 over everything; as it is where it is 0."""
    norm = gradient.norm()
    return gradient / norm if norm > 0 else gradient


def _to_textures(value: Tensor, textures: Tensor, *, keep: bool) -> Tensor:
    if not value.requires_grad:
        return torch.zeros_like(textures)
    (gradient,) = torch.autograd.grad(value, textures, retain_graph=keep, allow_unused=True)
    return torch.zeros_like(textures) if gradient is None else gradient.detach()
