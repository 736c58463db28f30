"""Opens and checks all inputs of an attack on the closed loop before the first drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gear.collecting.lookup import look_up
from gear.collecting.patch_sources import resolve_patch
from gear.config.dump import to_plain
from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.specs import AttackSpec
from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.driving.config import PATCH, DriveConfig
from gear.driving.drives import Cast, DriveRun, Drives, plan_drives, read_drive_config, surface_count
from gear.driving.start import Draw
from gear.driving.worker import DriveWorker
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import GearError, PlacementError, UnknownNameError
from gear.values.progress import Warn
from gear.values.serial import Json
from gear.verbs.attack.drives.request import DriveAttackRequest
from gear.verbs.attack.models import check_attack, check_gradient

HELD_OUT = "held_out"
"""Folder of the drives that judge the finished patches."""

HELD_OUT_SEED = 1_000_000
"""Difference between the seeds of the held-out drives and those of the config."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveJob:
    """All inputs of an attack on the closed loop, opened and checked.

    Attributes:
        request: the arguments.
        config: the drive config, reduced to the attacked driver.
        drives: the drives on which the patches are optimised.
        label: name of the attacked driver.
        surfaces: number of patch surfaces of the scene.
        found, spec: plugin of the attack and its spec.
        options, settings: options of the attack, as the user gave them and as a config object.
    """

    request: DriveAttackRequest
    config: DriveConfig
    drives: Drives
    label: str
    surfaces: int
    found: PluginEntry
    spec: AttackSpec[Any]
    options: Node
    settings: Any

    def plan(self, runs: Sequence[DriveRun], weights_sha256: str | None) -> Json:
        """Everything on which the patches depend, as JSON; a later run with an equal plan reuses the patches.

        Args:
            runs: the drives on which the patches are optimised.
            weights_sha256: hash of the weights of the driver's network; None without one.
        """
        request, run = self.request, runs[0]
        nothing = resolve_patch(NO_PATCH, surfaces=self.surfaces, seed=0)
        scene = look_up(self.drives.collection(run))
        return {
            "attack": {
                "name": self.spec.name,
                "package": self.found.owner.package,
                "version": self.found.owner.version,
                "options": to_plain(self.settings),
            },
            "drive": [self.drives.identity(one, nothing) for one in runs],
            "data": [{"scene": f"{scene.library.town_name}/{scene.config.scene}", "samples": len(runs)}],
            "task": self.drives.casts[self.label].task,
            "weights_sha256": weights_sha256,
            **self.budget(),
            "held_out_seeds": request.held_out,
            "seed": request.seed,
        }

    def budget(self) -> Json:
        """The options of the request that limit the attack, with the keys of the request."""
        names = ("steps", "redrive", "frames") if self.spec.needs_gradients else ("queries",)
        return {name: getattr(self.request, name) for name in names}

    def held_out(self) -> Drives | None:
        """The drives that judge the finished patches: the situations of the config at other seeds, each with no patch,
        a random patch and the patches in the folder of the attack; None if the user wants none.
        """
        if not self.request.held_out:
            return None
        root = Path(self.request.out).absolute()
        driver = replace(self.config.drivers[self.label], patch=str(root))
        config = replace(
            self.config,
            drivers={self.label: driver},
            twins=(NO_PATCH, RANDOM_PATCH, PATCH),
            seed=self.config.seed + HELD_OUT_SEED,
            repeats=self.request.held_out,
        )
        return plan_drives(config, root / HELD_OUT, self.request.device)


def resolve_drives(request: DriveAttackRequest) -> DriveJob:
    """Opens and checks everything that a request names: drive config, driver and attack.

    Args:
        request: the arguments of `gear.attack_drive`.

    Raises:
        GearError: something does not exist, or two inputs do not fit together.
    """
    given = read_drive_config(request.drive, request.drive_settings)
    label = _driver(given, request)
    scenes = [(town, scene) for town, names in given.towns.items() for scene in names]
    if len(scenes) > 1:
        town, scene = scenes[0]
        raise GearError(
            f"an attack on drives is for one scene, and the config names {len(scenes)}; choose one, such as"
            f" --drive-set 'towns={{{town}: [{scene}]}}'"
        )
    driver = replace(given.drivers[label], patch="")
    config = replace(given, drivers={label: driver}, twins=(NO_PATCH,), video=False, open_loop=False)
    drives = plan_drives(config, Path(request.out).absolute(), request.device)
    surfaces = surface_count(look_up(drives.collection(drives.runs[0])))
    if not surfaces:
        raise GearError(f"scene {scenes[0][1]!r} has no surface for a patch; name a scene with a board or a truck")
    found, options = find("attack", request.attack), with_overrides(NO_OPTIONS, request.settings)
    return DriveJob(
        request=request,
        config=config,
        drives=drives,
        label=label,
        surfaces=surfaces,
        found=found,
        spec=_checked_attack(found, drives.casts[label], surfaces),
        options=options,
        settings=read_node(found.spec.config, options, ""),
    )


def _driver(config: DriveConfig, request: DriveAttackRequest) -> str:
    """The name of the attacked driver.

    Raises:
        GearError: it does not exist, has no cameras, or is not the only one and was not named.
    """
    seeing = [name for name, one in config.drivers.items() if one.model or one.task]
    if request.driver is None:
        if len(seeing) != 1:
            listed = ", ".join(seeing) or "none"
            raise GearError(f"name the attacked driver with --driver; drivers with cameras: {listed}")
        return seeing[0]
    if request.driver not in config.drivers:
        raise UnknownNameError("driver", request.driver, config.drivers)
    if request.driver not in seeing:
        raise GearError(f"driver {request.driver!r} has no cameras, so it cannot see a patch")
    return request.driver


def _checked_attack(found: PluginEntry, cast: Cast, surfaces: int) -> AttackSpec[Any]:
    """The spec of an attack that fits the driver.

    Raises:
        GearError: the attack does not fit the driver or the number of surfaces.
    """
    spec = found.spec
    assert isinstance(spec, AttackSpec)
    if spec.is_control:
        raise GearError(f"attack {spec.name!r} optimises nothing; use square or nes")
    models = [] if cast.model is None else [cast.model]
    if spec.needs_gradients and not models:
        problem = f"attack {spec.name!r} needs gradients, and driver {cast.label!r} has no network"
        raise GearError(f"{problem}; use square or nes")
    check_attack(found, models, cast.task, surfaces, None if spec.needs_gradients else 1)
    check_gradient(cast.defense, spec)
    return spec


def placed_runs(job: DriveJob, worker: DriveWorker, on_warning: Warn) -> list[DriveRun]:
    """The drives of an attack, with the twin `patch`, without those for which the scene has no place.

    Args:
        job: the inputs of the attack.
        worker: opens the scene.
        on_warning: called with a line for each drive that is left out.

    Raises:
        GearError: the scene has no place for any of the drives.
    """
    found = []
    for run in job.drives.runs:
        scenario, speed_mps = job.drives.scenario(run), run.speed_kmh / 3.6
        try:
            worker.place_of(run).simulation.reset(
                Draw(name=run.scenario, scenario=scenario, speed_mps=speed_mps, seed=run.seed)
            )
        except PlacementError as error:
            on_warning(f"left out: {run.title}: {error}")
            continue
        found.append(replace(run, twin=PATCH))
    if not found:
        raise GearError("the scene has no place for any of the drives; choose other scenarios, speeds or seeds")
    return found
