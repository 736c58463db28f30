"""Jedi (Tarchoun et al., CVPR 2023): locates patches by their local entropy, and inpaints them."""

from __future__ import annotations

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.masking.jedi_options import JediConfig


def build(config: JediConfig) -> Defense:
    """Makes the defense Jedi from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.masking.jedi import Jedi

    return Jedi(config)


spec = DefenseSpec(
    name="jedi",
    summary="Jedi: locates patches by their local entropy, and inpaints them.",
    config=JediConfig,
    build=build,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="surrogate",
    needs_calibration=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[JediConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
