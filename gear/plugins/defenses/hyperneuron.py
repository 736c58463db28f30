"""HyperNeuron (Co et al., 2021): a score of how unusual the values of a network's neurons are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.activations.options import DetectorConfig

if TYPE_CHECKING:
    from torch import Tensor

FAR = 3.0
"""Magnitude of a z-score above which a neuron counts for the aggregate `share`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HyperNeuronConfig(DetectorConfig):
    """Options of the defense `hyperneuron`. They include the options of `DetectorConfig`.

    The paper computes the score from the z-scores of all features of one layer, but does not say how they are combined.

    Attributes:
        statistics: what has a mean and a deviation: each `neuron` (channel and position), or the mean over a picture of
            each `channel`.
        aggregate: `mean` magnitude of the z-scores, their root mean square (`rms`), or the `share` of magnitudes above
            3.
    """

    statistics: Literal["neuron", "channel"] = "neuron"
    aggregate: Literal["mean", "rms", "share"] = "mean"


def build(config: HyperNeuronConfig) -> Defense:
    """Makes the defense `hyperneuron` from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.activations.score_detector import Detector

    def compress(features: Tensor) -> Tensor:
        return features if config.statistics == "neuron" else features.mean(dim=(1, 2))

    def aggregate(z: Tensor) -> Tensor:
        if config.aggregate == "rms":
            return z.square().mean().sqrt()
        return (z.abs() > FAR).double().mean() if config.aggregate == "share" else z.abs().mean()

    return Detector(config.layer, compress, aggregate, config.false_alarms)


spec = DefenseSpec(
    name="hyperneuron",
    summary="HyperNeuron: scores how unusual the deepest feature map is (a detector of the paper).",
    config=HyperNeuronConfig,
    build=build,
    outputs=frozenset({"score"}),
    gradient="differentiable",
    needs_calibration=True,
    needs_model=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[HyperNeuronConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
