"""The baseline on 2D boxes: the foot of each box is a point on the flat ground in front of the car."""

from __future__ import annotations

from dataclasses import dataclass

from gear.contracts.controllers import Observation
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.box_foot import foot_gap_m
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting
from gear.values.errors import FieldError

ROAD_USERS = frozenset({1, 2, 3, 4, 6, 7, 8})
"""COCO's category ids of road users: person, bicycle, car, motorcycle, bus, train and truck."""

FARTHEST_M = 80.0
"""Distance beyond which a foot on the ground is too uncertain: one pixel is several metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Detect2dDriverConfig(BaselineConfig):
    """Options of the baseline on 2D boxes. They include the options of `BaselineConfig`.

    Attributes:
        min_score: smallest confidence of a detection that counts, 0 to 1.
    """

    min_score: float = 0.5

    def __post_init__(self) -> None:
        BaselineConfig.__post_init__(self)
        if not 0 <= self.min_score <= 1:
            raise FieldError("min_score", f"must be 0 to 1, got {self.min_score:g}")


class Detect2dDriver(Baseline):
    """The baseline driver with a detector of 2D boxes.

    Args:
        config: options of the driver.
    """

    def __init__(self, config: Detect2dDriverConfig) -> None:
        super().__init__(config)
        self._min_score = config.min_score

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the road user whose box has its foot in the corridor with the smallest gap; None without one.

        Args:
            observation: the frame; its prediction is the detections in the first camera's picture.
            corridor: the strip of road that the car needs, in the ego frame.
        """
        gaps_m = [
            foot_gap_m(detection.box_px, observation.cameras[0], corridor, FARTHEST_M)
            for detection in observation.prediction
            if detection.score >= self._min_score and detection.category_id in ROAD_USERS
        ]
        found = [gap_m for gap_m in gaps_m if gap_m is not None]
        return Sighting(gap_m=min(found)) if found else None


spec = ControllerSpec(
    name="detect2d_baseline",
    summary="Brakes for 2D boxes: the foot of a box on the ground plane.",
    config=Detect2dDriverConfig,
    build=Detect2dDriver,
    tasks=("detect2d",),
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[Detect2dDriverConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
