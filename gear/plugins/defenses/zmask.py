"""Z-Mask (Rossolini et al., AAAI 2023): covers regions that over-activate a network's layers, and gives a score."""

from __future__ import annotations

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.activations.zmask_options import ZMaskConfig


def build(config: ZMaskConfig) -> Defense:
    """Makes the defense Z-Mask from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.activations.zmask import ZMask

    return ZMask(config)


spec = DefenseSpec(
    name="zmask",
    summary="Z-Mask: covers regions that over-activate shallow and deep layers (a defense of the paper).",
    config=ZMaskConfig,
    build=build,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="surrogate",
    needs_calibration=True,
    needs_model=True,
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[ZMaskConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
