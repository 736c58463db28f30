"""The arguments of `gear.attack_drive` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.errors import GearError
from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveAttackRequest:
    """The arguments of `gear.attack_drive`.

    Attributes:
        drive, drive_settings: name or path of the drive config, and `KEY=VALUE` texts that replace its values.
        out: the patch folder.
        driver: name of the attacked driver of the config; None for the only driver with cameras.
        attack, settings: name of the attack plugin, and its `KEY=VALUE` options.
        queries: largest number of queries, for attacks without gradients; a query drives a batch of situations with
            one patch.
        steps: number of optimisation steps, for attacks with gradients.
        redrive: number of steps after which an attack with gradients drives the situations anew.
        frames: number of frames of the drives on which an attack with gradients optimises in each round.
        held_out: number of further seeds at which the finished patches are compared with no patch and with a random
            patch; 0 for no comparison.
        seed: seed of the attack.
        device: device of the network; None for that of the config.
        force: whether results of an earlier attack in `out` are deleted first.

    Raises:
        GearError: a number is out of range.
    """

    drive: str | Path
    out: str | Path
    drive_settings: tuple[str, ...] = ()
    driver: str | None = None
    attack: str = "square"
    queries: int = 100
    steps: int = 300
    redrive: int = 100
    frames: int = 60
    settings: tuple[str, ...] = ()
    held_out: int = 3
    seed: int = 0
    device: str | None = None
    force: bool = False

    def __post_init__(self) -> None:
        check_seed(self.seed)
        if self.queries < 2:
            raise GearError(f"queries must be at least 2, got {self.queries}")
        for name in ("steps", "redrive", "frames"):
            if getattr(self, name) < 1:
                raise GearError(f"{name} must be at least 1, got {getattr(self, name)}")
        if not 0 <= self.held_out <= 10_000:
            raise GearError(f"held_out must be 0 to 10000, got {self.held_out}")
