"""What a record claims about drives in the closed loop: the outcome of each drive, and the hash of its log.

Collision rates are not stated: they follow from the drives. A drive depends only on the config and its seed, so a check
drives again and compares the hash of the log.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from gear.leaderboard.field_checks import check_name, check_number, check_sha256

Key = tuple[str, str, str, float, int, str]
"""Scene, weather, scenario, speed in km/h, seed, and kind of patch of a drive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveClaim:
    """The claimed outcome of one drive.

    Attributes:
        scene: name of the scene in the benchmark.
        scenario: name of the scenario.
        speed_kmh: speed of the ego car at the start.
        seed: seed of the drive.
        patch: kind of patch: `none`, `random`, `patch` or `adaptive patch`.
        is_free: whether nothing is in the way of the car, so that the drive does not count in collision rates.
        is_crash: whether the car crashed.
        score: CARLA's driving score, 0..1.
        log_sha256: SHA-256 of the drive's log.
        weather: name of the weather in the benchmark; "" if the benchmark has only one.
    """

    scene: str
    scenario: str
    speed_kmh: float
    seed: int
    patch: str
    is_free: bool
    is_crash: bool
    score: float
    log_sha256: str
    weather: str = ""

    def __post_init__(self) -> None:
        for field in ("scene", "scenario", "patch"):
            check_name(field, getattr(self, field))
        if self.weather:
            check_name("weather", self.weather)
        check_number("speed_kmh", self.speed_kmh, low=0, high=1000)
        check_number("seed", self.seed, low=0, high=1e18)
        check_number("score", self.score, low=0, high=1)
        check_sha256("log_sha256", self.log_sha256)

    @property
    def key(self) -> Key:
        """What identifies the drive among those of its record."""
        return self.scene, self.weather, self.scenario, self.speed_kmh, self.seed, self.patch


def crashes(drives: Iterable[DriveClaim], patch: str) -> list[bool]:
    """Whether each drive with one kind of patch ended in a crash; drives on free roads are left out.

    Args:
        drives: the drives of a record.
        patch: kind of patch.
    """
    return [one.is_crash for one in drives if one.patch == patch and not one.is_free]
