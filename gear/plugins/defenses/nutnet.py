"""NutNet (Lin et al., CCS 2024): blocks that an autoencoder of clean pictures cannot reconstruct become grey."""

from __future__ import annotations

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.masking.nutnet_options import NutNetConfig


def build(config: NutNetConfig) -> Defense:
    """Makes the defense NutNet from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.masking.nutnet import NutNet

    return NutNet(config)


spec = DefenseSpec(
    name="nutnet",
    summary="NutNet: blocks that an autoencoder of clean pictures cannot reconstruct become grey.",
    config=NutNetConfig,
    build=build,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="surrogate",
    needs_calibration=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[NutNetConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
