"""SAC, Segment and Complete (Liu et al., CVPR 2022): a U-Net segments patches, and masks are completed."""

from __future__ import annotations

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.masking.sac_options import SacConfig


def build(config: SacConfig) -> Defense:
    """Makes the defense SAC from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.masking.sac import Sac

    return Sac(config)


spec = DefenseSpec(
    name="sac",
    summary="SAC, Segment and Complete: a U-Net segments patches, and masks are completed to rectangles.",
    config=SacConfig,
    build=build,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="surrogate",
    needs_calibration=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[SacConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
