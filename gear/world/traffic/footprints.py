"""Footprints of road users on the ground, by which gaps between them are tested."""

from __future__ import annotations

import math
from dataclasses import dataclass

LEVEL_M = 3.0
"""Height difference in metres above which two objects are on different levels of the town, such as a bridge and the
road below.
"""


@dataclass(frozen=True, slots=True)
class Footprint:
    """The footprint of a road user: an oriented rectangle on the ground.

    Attributes:
        x_m, y_m, z_m: middle of the rectangle, world coordinates.
        yaw_rad: direction of its length, counter-clockwise from east.
        half_length_m, half_width_m: half of the rectangle's sides.
    """

    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    half_length_m: float
    half_width_m: float

    def grown(self, length_m: float, width_m: float) -> Footprint:
        """The rectangle extended by `length_m` at both ends and by `width_m` at both sides.

        Args:
            length_m: added at the front and at the rear, metres.
            width_m: added at the left and at the right, metres.
        """
        return Footprint(
            self.x_m, self.y_m, self.z_m, self.yaw_rad, self.half_length_m + length_m, self.half_width_m + width_m
        )

    @property
    def radius_m(self) -> float:
        """Radius in metres of the smallest circle around the rectangle's middle that contains the rectangle."""
        return math.hypot(self.half_length_m, self.half_width_m)

    def overlaps(self, other: Footprint) -> bool:
        """Whether this rectangle and `other` are on the same level and have a common point (separating axis
        theorem).

        Args:
            other: another footprint.
        """
        dx, dy = other.x_m - self.x_m, other.y_m - self.y_m
        if math.hypot(dx, dy) > self.radius_m + other.radius_m or abs(other.z_m - self.z_m) > LEVEL_M:
            return False
        turn = other.yaw_rad - self.yaw_rad
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        for first, second, sign in ((self, other, 1.0), (other, self, -1.0)):
            cy, sy = math.cos(first.yaw_rad), math.sin(first.yaw_rad)
            along, across = sign * (dx * cy + dy * sy), sign * (-dx * sy + dy * cy)
            if abs(along) > first.half_length_m + second.half_length_m * c + second.half_width_m * s:
                return False
            if abs(across) > first.half_width_m + second.half_length_m * s + second.half_width_m * c:
                return False
        return True
