"""A model with its defense: predicts from pictures and measures the computing time."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.defenses import DefenseResult, FitReport
from gear.contracts.models import BatchPredictor, Model, Trainable
from gear.contracts.specs import DefenseSpec, ModelSpec
from gear.dataset.reading import Dataset
from gear.measuring.calibration import Calibration, Views
from gear.measuring.checked_defense import CheckedDefense
from gear.measuring.guard import UNGUARDED, OpenedGuard
from gear.measuring.parallel_batches import lanes_of
from gear.measuring.plugin_selection import Chosen
from gear.plugins.build import blamed, build
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import DISTRIBUTION
from gear.values.errors import PluginError
from gear.values.rng import derive_rng

SMALL_PX, MOST_TOGETHER = 1_400_000, 4
"""Largest number of pixels and of samples in a default batch; larger batches make no network of gear faster on a CPU,
and some slower.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TimedPrediction:
    """The prediction for one sample, with the defense's outputs and the computing time.

    Attributes:
        prediction: prediction in the task's format.
        model_s, defense_s: wall time in seconds; the model's time for a batch is divided by the number of its samples
            and by the number of parallel batches.
        mask: the defense's patch mask by camera name, (H, W) float32 in 0..1; None without a mask.
        score: the defense's confidence in 0..1 that the sample is attacked; None without a score.
        defended: the pictures that the defense returned, (H, W, 3) uint8 RGB by camera; None without a defense.
    """

    prediction: Any
    model_s: float
    defense_s: float
    mask: Mapping[str, npt.NDArray[np.float32]] | None
    score: float | None
    defended: Views | None = None


class GuardedModel:
    """A built model together with its defense, if there is one.

    Attributes:
        plugin: plugin of the model.
        model: the model, wrapped by its defense if there is one.
        weights_sha256: hash of the weights of the model without its defense; None for a model that is no torch module.
        lanes: number of threads that may call `predict` at a time; 1 with a defense and for models of other packages.
    """

    def __init__(
        self,
        model: Chosen,
        guard: OpenedGuard = UNGUARDED,
        *,
        seed: int = 0,
    ) -> None:
        """Builds the model and wraps it by its defense; calibration starts with the first call of `predict`.

        Args:
            model: plugin of the model with its options.
            guard: the defense with its calibration data.
            seed: seed of the defense's calibration and random draws.

        Raises:
            GearError: options or weights do not fit, or code of another package fails.
        """
        spec = model.found.spec
        assert isinstance(spec, ModelSpec)
        self.plugin, self._views, self._seed = model.found, spec.views, seed
        bare: Model = build(model.found, model.options)
        self.weights_sha256 = weights_digest(bare)
        self.model: Model = bare
        self._guard: CheckedDefense | None = None
        self._guard_name = ""
        if guard.defense is not None:
            self._guard_name = guard.defense.found.spec.name
            self._guard, self.model = self._guarded(guard.defense, bare, guard.calibration)
        # A wrapper that forwards `predict_many` to the bare model by `__getattr__` would leave the defense out.
        is_own = self.model is bare or inspect.getattr_static(self.model, "predict_many", None) is not None
        self._many = self.model.predict_many if isinstance(self.model, BatchPredictor) and is_own else None
        self._is_ours = model.found.owner.package == DISTRIBUTION and guard.defense is None
        self.lanes = lanes_of(bare) if self._is_ours else 1
        self._at_work, self._counting = 0, threading.Lock()

    def fit_report(self) -> FitReport | None:
        """The defense's summary of its calibration in this run; None without a defense, a calibration or a summary."""
        return None if self._guard is None else self._guard.fit_report()

    def _guarded(self, defense: Chosen, bare: Model, calibration: Calibration) -> tuple[CheckedDefense, Model]:
        found = defense.found
        spec = found.spec
        assert isinstance(spec, DefenseSpec)
        product = build(found, defense.options)
        with blamed(found, "wrap"):
            wrapped: Model = product.wrap(bare)
        learn = partial(calibration.fit, defense, product, bare, self._views, self._seed)
        return CheckedDefense(found, product, bare if spec.needs_model or spec.taps else None, learn), wrapped

    def is_random(self, pictures: Views) -> bool:
        """Whether the defense gives another result for the same sample if its random generator has another state;
        False without a defense.

        Args:
            pictures: (H, W, 3) uint8 pictures of one sample by camera name.
        """
        if self._guard is None:
            return False
        seen = {name: pictures[name] for name in self._views}
        one, other = (
            self._guard.apply(seen, derive_rng(self._seed, "randomness", self._guard_name, draw), 0) for draw in (0, 1)
        )
        same = [np.array_equal(one.views[name], other.views[name]) for name in one.views]
        masks, others = one.mask or {}, other.mask or {}
        same += [np.array_equal(masks[name], others[name]) for name in masks]
        return one.score != other.score or not all(same)

    def usual_batch(self, dataset: Dataset[Any]) -> int:
        """The default number of samples in a batch of a dataset.

        For gear's own models it is the largest number whose pictures have at most `SMALL_PX` pixels, but at least 1 and
        at most `MOST_TOGETHER`. It is 1 for models with a defense and for models of other packages.

        Args:
            dataset: the dataset; the size of its pictures counts.
        """
        if not self._is_ours or self._many is None or not len(dataset):
            return 1
        cameras = [camera for camera in dataset.sidecar(0).record.cameras if camera.name in self._views]
        pixels = sum(camera.width_px * camera.height_px for camera in cameras)
        return max(1, min(MOST_TOGETHER, SMALL_PX // max(pixels, 1)))

    def predict(self, pictures: Sequence[Views], indices: Sequence[int]) -> list[TimedPrediction]:
        """Applies the defense to a batch of samples and predicts from its output.

        Args:
            pictures: (H, W, 3) uint8 pictures by camera name, for each sample.
            indices: indices of the samples in the split.

        Returns:
            One prediction per sample, in order.

        Raises:
            PluginError: a model or defense of another package fails.
        """
        if self._guard is not None:
            _ = self._guard.state  # learns now, not on the first sample's time
        results: list[DefenseResult | None] = []
        spent: list[float] = []
        shown: list[Views] = []
        for views, index in zip(pictures, indices, strict=True):
            seen = {name: views[name] for name in self._views}
            for picture in seen.values():
                picture.setflags(write=False)
            begun = time.perf_counter()
            result = None
            if self._guard is not None:
                rng = derive_rng(self._seed, "evaluate", self._guard_name, index)
                result = self._guard.apply(seen, rng, index)
            spent.append(time.perf_counter() - begun if result else 0.0)
            results.append(result)
            shown.append(result.views if result else seen)
        begun, beside = time.perf_counter(), self._count(+1)
        try:
            predictions = self._predict(shown, indices)
        finally:
            beside += 1 + self._count(-1)
        each_s = (time.perf_counter() - begun) / len(indices) / (beside / 2)
        return [
            TimedPrediction(
                prediction=prediction,
                model_s=each_s,
                defense_s=defense_s,
                mask=result.mask if result else None,
                score=None if result is None or result.score is None else float(result.score),
                defended=result.views if result else None,
            )
            for prediction, defense_s, result in zip(predictions, spent, results, strict=True)
        ]

    def _count(self, change: int) -> int:
        """Counts the threads that enter and leave; returns their number."""
        with self._counting:
            self._at_work += change
            return self._at_work

    def _predict(self, shown: Sequence[Views], indices: Sequence[int]) -> list[Any]:
        stage = f"predict on sample {indices[0]}" + (f" to {indices[-1]}" if len(indices) > 1 else "")
        with blamed(self.plugin, stage) if self.lanes == 1 else contextlib.nullcontext():
            if self._many is None:
                return [self.model.predict(views) for views in shown]
            answers = list(self._many(list(shown)))
        if len(answers) != len(shown):
            raise plugin_error(self.plugin, stage, f"predict_many gave {len(answers)} answers to {len(shown)} samples")
        return answers


def plugin_error(plugin: PluginEntry, stage: str, problem: str) -> PluginError:
    """Makes an error whose message names the plugin, its package and version, and the stage at which it failed.

    Args:
        plugin: the plugin.
        stage: what the plugin did, such as `its evaluator`.
        problem: what went wrong.
    """
    return PluginError(f"{plugin.spec.name} ({plugin.owner.package} {plugin.owner.version})", stage, problem)


def weights_digest(model: Any) -> str | None:
    """The sha256 over names and bytes of a torch module's parameters and buffers; None for a model without torch
    modules.
    """
    torch = sys.modules.get("torch")
    if torch is None:
        return None
    digest, is_empty = hashlib.sha256(), True
    for name, tensor in _tensors(model, torch):
        plain = tensor.detach().cpu().contiguous()
        digest.update(f"{name} {plain.dtype} {tuple(plain.shape)}".encode())
        digest.update(plain.reshape(-1).view(torch.uint8).numpy().tobytes())
        is_empty = False
    return None if is_empty else digest.hexdigest()


def _tensors(model: Any, torch: Any) -> Iterator[tuple[str, Any]]:
    module = model.module() if isinstance(model, Trainable) else model
    parts = {"": module} if isinstance(module, torch.nn.Module) else vars(model) if hasattr(model, "__dict__") else {}
    for part, network in parts.items():
        if isinstance(network, torch.nn.Module):
            for name, tensor in network.state_dict().items():
                yield f"{part}.{name}", tensor
