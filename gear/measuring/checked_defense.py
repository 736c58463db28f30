"""Wraps a defense and checks each of its results against the contract of defenses."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.defenses import Defense, DefenseResult, FitReport, ReportsFit
from gear.contracts.models import Model
from gear.plugins.build import blamed
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import PluginError
from gear.values.frames import UInt8Image

NUMBERS = (int, float, np.floating, np.integer)


class CheckedDefense:
    """A defense whose results are checked; errors name the plugin that the defense comes from."""

    def __init__(
        self,
        found: PluginEntry,
        defense: Defense,
        model: Model | None = None,
        learn: Callable[[], Any] = lambda: None,
    ) -> None:
        """Wraps a defense; it is not calibrated yet.

        Args:
            found: plugin of the defense.
            defense: the built defense.
            model: the model without the defense, for a defense that uses its feature maps or predictions.
            learn: function that calibrates the defense and returns its state; called once, before the first sample.
        """
        self._found, self._defense, self._model, self._learn = found, defense, model, learn

    @functools.cached_property
    def state(self) -> Any:
        """The calibrated state of the defense, computed on first access because calibration takes minutes."""
        return self._learn()

    def fit_report(self) -> FitReport | None:
        """The defense's summary of its calibration; None if it is not calibrated yet or provides no summary."""
        state = self.__dict__.get("state")
        return state.fit_report() if isinstance(state, ReportsFit) else None

    def apply(self, views: Mapping[str, UInt8Image], rng: np.random.Generator, index: int) -> DefenseResult:
        """Applies the defense to the pictures of one sample and checks the result.

        Args:
            views: (H, W, 3) uint8 pictures by camera name.
            rng: random generator of the sample.
            index: index of the sample.

        Returns:
            The checked result: pictures, and the mask and score if the defense has them.

        Raises:
            PluginError: the defense fails, or returns something that its contract does not allow.
        """
        for picture in views.values():
            picture.setflags(write=False)
        with blamed(self._found, f"apply on sample {index}"):
            result = self._defense.apply(views, self._model, self.state, rng)
        problem = self._problem(result, views)
        if problem:
            raise self._error(index, problem)
        # NumPy's numbers will do, but are no JSON.
        return result if result.score is None else dataclasses.replace(result, score=float(result.score))

    def _problem(self, result: Any, views: Mapping[str, UInt8Image]) -> str:
        """Describes the first violation of the contract in a defense's result; empty if the result is valid."""
        if not isinstance(result, DefenseResult):
            return f"apply returns a DefenseResult, got {type(result).__name__}"
        sizes = {name: picture.shape[:2] for name, picture in views.items()}
        outputs = self._found.spec.outputs  # type: ignore[attr-defined]
        has_mask = "mask" in outputs or result.mask is not None  # what was not promised is used, too
        for name, size in sizes.items():
            if not _is_array(_of_camera(result.views, name), (*size, 3), np.uint8):
                return f"views[{name!r}] must have shape {(*size, 3)} of uint8"
            if not has_mask:
                continue
            mask = _of_camera(result.mask, name)
            if not _is_array(mask, size, np.float32):
                return f"mask[{name!r}] must have shape {size} of float32"
            if not (mask.min() >= 0 and mask.max() <= 1):  # NaN is neither
                return f"mask[{name!r}] must lie in 0..1, got {mask.min():g} to {mask.max():g}"
        if unknown := (result.mask or {}).keys() - sizes.keys():
            return f"mask[{min(unknown)!r}] is of no camera that it was shown"
        has_score = "score" in outputs or result.score is not None
        if has_score and not (isinstance(result.score, NUMBERS) and 0 <= result.score <= 1):
            return f"score must be a float in 0..1, got {result.score!r}"
        return ""

    def _error(self, index: int, problem: str) -> PluginError:
        owner = self._found.owner
        name = f"{self._found.spec.name} ({owner.package} {owner.version})"
        return PluginError(name, f"apply on sample {index}", problem)


def _of_camera(given: object, name: str) -> Any:
    """The entry of a defense's result for one camera; None if it is missing."""
    return given.get(name) if isinstance(given, Mapping) else None


def _is_array(value: object, shape: tuple[int, ...], dtype: npt.DTypeLike) -> bool:
    return isinstance(value, np.ndarray) and value.shape == shape and value.dtype == dtype
