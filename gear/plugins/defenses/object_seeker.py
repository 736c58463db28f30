"""ObjectSeeker (Xiang et al., IEEE S&P 2023): adds objects that a detector finds if half of the picture is covered."""

from __future__ import annotations

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.multi_pass.options import ObjectSeekerConfig


def build(config: ObjectSeekerConfig) -> Defense:
    """Makes the defense ObjectSeeker from its options.

    Args:
        config: options of the defense.
    """
    from gear.plugins.defenses.multi_pass.object_seeker import ObjectSeeker

    return ObjectSeeker(config)


spec = DefenseSpec(
    name="object_seeker",
    summary="ObjectSeeker: adds objects that a detector finds if half of the picture is covered.",
    config=ObjectSeekerConfig,
    build=build,
    tasks=("detect2d",),
    gradient="surrogate",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[ObjectSeekerConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
