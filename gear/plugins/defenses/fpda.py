"""FPDA (Rossolini et al., IEEE TNNLS 2023): scores unusual features of a network after averaging over channels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.activations.options import DetectorConfig

if TYPE_CHECKING:
    from torch import Tensor

PEAK_CELLS = 3
"""Side in cells of the window over which the option `peak` averages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FpdaConfig(DetectorConfig):
    """Options of the defense `fpda`. They include the options of `DetectorConfig`.

    The paper says that features are compressed over channels and compared by z-scores, but gives no details.

    Attributes:
        compress: what is averaged over channels: the features (`mean`) or their magnitudes (`mean_abs`).
        aggregate: `mean` is the mean magnitude of the z-scores; `peak` the largest mean of a 3 x 3 window, for patches
            far away.
    """

    compress: Literal["mean", "mean_abs"] = "mean"
    aggregate: Literal["mean", "peak"] = "mean"


def build(config: FpdaConfig) -> Defense:
    """Makes the defense `fpda` from its options.

    Args:
        config: options of the defense.
    """
    from torch.nn import functional

    from gear.plugins.defenses.activations.score_detector import Detector

    def compress(features: Tensor) -> Tensor:
        return (features if config.compress == "mean" else features.abs()).mean(dim=0)

    def aggregate(z: Tensor) -> Tensor:
        if config.aggregate == "mean":
            return z.abs().mean()
        window = tuple(min(PEAK_CELLS, side) for side in z.shape)
        return functional.avg_pool2d(z.abs()[None, None], window, stride=1).amax()

    return Detector(config.layer, compress, aggregate, config.false_alarms)


spec = DefenseSpec(
    name="fpda",
    summary="FPDA: scores unusual features, averaged over channels (a detector of the paper).",
    config=FpdaConfig,
    build=build,
    outputs=frozenset({"score"}),
    gradient="differentiable",
    needs_calibration=True,
    needs_model=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[FpdaConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
