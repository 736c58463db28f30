"""Adversarial patch training: part of the training pictures contain patches that are optimised against the
network.

As in meta adversarial training (Metzen et al., "Meta Adversarial Training against Universal Patches", 2021), a pool of
patches is maintained. Before every pass over the data a new set of patches is added; if the pool is full, the oldest
set is removed. A compositor puts the patches into pictures before augmentation, so patches are cropped, mirrored and
recoloured like the rest of the picture.
"""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.compositor.base import Prepared
from gear.compositor.cache import Cache
from gear.compositor.registry import open_compositor
from gear.contracts.attacks import Budget
from gear.contracts.specs import AttackSpec
from gear.measuring.patch_checks import check_patches
from gear.networks.runtime import as_bytes
from gear.plugins.build import blamed, build, find
from gear.readers import Samples
from gear.values.errors import GearError
from gear.values.rng import derive_rng
from gear.verbs.train.config import Adversarial

CACHE_BYTES = 1 << 30
"""Memory for the compositors of all scenes together, in bytes."""


class Adversary:
    """Optimises patches against the network during its training, and puts these patches into training samples."""

    def __init__(
        self,
        samples: Samples,
        config: Adversarial,
        *,
        task: str,
        seed: int,
        device: torch.device,
        cache_bytes: int = CACHE_BYTES,
    ) -> None:
        """Builds the attack, and opens a compositor for each training dataset with patch surfaces.

        Args:
            samples: training samples; those of scenes with patch surfaces get patches.
            config: the attack with its settings.
            task: task that the attack must support.
            seed: seed of the draws of scenes and samples and of the attack.
            device: device of the compositor.
            cache_bytes: memory for the compositors of all scenes together.

        Raises:
            GearError: the attack does not support the task, is limited by queries instead of steps, or makes fewer
                patches than a scene has surfaces; or no training scene has a patch surface.
            DatasetError: a scene lacks probes.
        """
        self._samples, self._config, self._seed = samples, config, seed
        self._found = find("attack", config.attack)
        spec = self._found.spec
        assert isinstance(spec, AttackSpec)
        if spec.tasks and task not in spec.tasks:
            raise GearError(f"attack {spec.name!r} is for {', '.join(spec.tasks)}, not {task}")
        if not spec.needs_gradients and not spec.is_control:
            raise GearError(
                f"attack {spec.name!r} is counted in forward passes, and a training makes its patches in steps; take "
                "one with gradients, such as scene_specific"
            )
        self._attack = build(self._found, config.options)
        places = [samples.places[index] for index in range(len(samples))]
        used = sorted({dataset for dataset, _ in places})
        with_surfaces = [number for number in used if samples.datasets[number].sidecar(0).record.surfaces]
        if not with_surfaces:
            raise GearError("no training scene has a surface for a patch; collect some around a billboard")
        for number in with_surfaces:
            surfaces = len(samples.datasets[number].sidecar(0).record.surfaces)
            if surfaces > spec.max_surfaces:
                raise GearError(
                    f"attack {spec.name!r} makes up to {spec.max_surfaces} patches; the scene of "
                    f"{samples.datasets[number].root} has {surfaces} surfaces"
                )
        cache: Cache[Prepared] = Cache(cache_bytes)
        self._compositors = {
            number: open_compositor(config.compositor, samples.datasets[number], device=device, cache=cache)
            for number in with_surfaces
        }
        self._indices = {number: [i for dataset, i in places if dataset == number] for number in with_surfaces}
        self._pool: list[tuple[Tensor, ...]] = []
        self._lock = threading.Lock()

    def refresh(self, model: Any, epoch: int) -> None:
        """Optimises one set of patches against the model in its current state and adds the set to the pool.

        The patches are optimised on samples of one scene, which is drawn at random.

        Args:
            model: the network that is attacked.
            epoch: number of the pass over the data; it seeds the random draws.
        """
        rng = derive_rng(self._seed, "adversary", epoch)
        number = sorted(self._compositors)[int(rng.integers(len(self._compositors)))]
        there = self._indices[number]
        chosen = [there[i] for i in sorted(rng.permutation(len(there))[: self._config.samples])]
        dataset = self._samples.datasets[number]
        with blamed(self._found, "optimise"):
            patches = self._attack.optimise(
                model,
                [dataset[index] for index in chosen],
                _Chosen(self._compositors[number], chosen),
                budget=Budget(steps=self._config.steps),
                rng=rng,
            )
        check_patches(patches, len(dataset.sidecar(0).record.surfaces), self._found)
        tensors = tuple(torch.from_numpy(patch.rgb).permute(2, 0, 1).contiguous() for patch in patches)
        self._pool = [*self._pool, tensors][-self._config.pool :]

    def change(self, sample: Any, index: int, rng: np.random.Generator) -> Any:
        """Puts patches of the pool on the surfaces of a sample, with the probability `share` of the config.

        Several threads may call this method at the same time.

        Args:
            sample: the training sample.
            index: index of the sample in the training samples.
            rng: generator of the random draws.

        Returns:
            A copy of the sample with changed pictures, or the sample itself.
        """
        dataset, place = self._samples.places[index]
        if dataset not in self._compositors or not self._pool or rng.random() >= self._config.share:
            return sample
        patches = self._pool[int(rng.integers(len(self._pool)))]
        wanted = len(sample.record.surfaces)
        shown = [patches[number % len(patches)] for number in range(wanted)]
        with self._lock, torch.no_grad():
            images = {
                view: as_bytes(self._compositors[dataset].compose(shown, [place], view)[0]) for view in sample.images
            }
        return dataclasses.replace(sample, images=images)

    def state(self) -> dict[str, Tensor]:
        """Returns all patches of the pool as named (3, h, w) tensors, for a checkpoint."""
        return {f"{n:04d}.{k:02d}": patch for n, patches in enumerate(self._pool) for k, patch in enumerate(patches)}

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Replaces the pool by the patches in `state`, tensors that the method `state` returned."""
        sets: dict[str, list[Tensor]] = {}
        for key in sorted(state):
            sets.setdefault(key.partition(".")[0], []).append(state[key])
        self._pool = [tuple(patches) for patches in sets.values()]


class _Chosen:
    """A compositor for some of the samples of a split; the samples are indexed from 0."""

    def __init__(self, compositor: Any, indices: Sequence[int]) -> None:
        self._compositor, self._indices = compositor, tuple(indices)

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        composed: Tensor = self._compositor.compose(patches, [self._indices[index] for index in samples], view)
        return composed
