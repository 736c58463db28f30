"""The blind controller: it keeps to the lane and to its speed, and sees no obstacle. The floor of every comparison."""

from __future__ import annotations

from gear.contracts.controllers import Observation
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting


class Blind(Baseline):
    """The baseline driver without a reader of obstacles: it keeps to the lane and brakes for nothing."""

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns None: the driver sees no obstacle.

        Args:
            observation, corridor: not used.
        """
        return None


spec = ControllerSpec(
    name="blind",
    summary="Keeps to the lane and sees no obstacle: the floor of every comparison.",
    config=BaselineConfig,
    build=Blind,
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[BaselineConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
