"""The list of drives of a study, each with the folder of its results."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gear.collecting.job import versions
from gear.collecting.lookup import Named, look_up
from gear.collecting.patch_sources import PatchSet, resolve_patch
from gear.config.collection import CollectionConfig
from gear.config.dump import to_plain
from gear.config.load import find_config
from gear.config.nodes import Mapping, Place, Scalar, parse_file
from gear.config.overrides import merged, with_overrides
from gear.config.reader import located_errors, read_node
from gear.contracts.specs import ControllerSpec, ModelSpec
from gear.contracts.tasks import NO_PATCH
from gear.dataset.json_text import dump_json
from gear.driving.config import NAMES, PATCH, DriveConfig, Driver
from gear.driving.scenario import Scenario, ScenarioLibrary, load_scenarios
from gear.driving.video import check_video
from gear.measuring.plugin_selection import Chosen, check_defense, check_optics
from gear.plugins.build import find
from gear.plugins.text import printable
from gear.values.errors import GearError, UnknownNameError
from gear.values.serial import Json, to_json

NO_CAMERA_TASK = "semseg"
"""Task whose name completes the collection config of drivers without cameras; it decides nothing."""

LONGEST_TITLE = 400
"""Largest number of characters of a drive's title."""

RUNS = "drives"
"""Name of the folder of all drives."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveRun:
    """One drive of a study.

    Attributes:
        driver: name of the driver.
        town, scene: the place.
        scenario: name of the scenario.
        speed_kmh: speed of the ego car, km/h.
        seed: seed of all draws.
        twin: `none`, `random` or `patch`.
    """

    driver: str
    town: str
    scene: str
    scenario: str
    speed_kmh: float
    seed: int
    twin: str

    @property
    def situation(self) -> tuple[str, str, str, float, int]:
        """What all twins and drivers of a situation have in common: town, scene, scenario, speed in km/h, and seed."""
        return self.town, self.scene, self.scenario, self.speed_kmh, self.seed

    @property
    def caption(self) -> str:
        """Twin, driver and situation in a few printable words: the title of the drive's video."""
        where = f"{Path(self.town).stem}/{self.scene}"
        speed = f"{self.speed_kmh:g} km/h"
        return printable(
            f"{self.twin.upper()}   {self.driver}: {self.scenario} at {speed}, {where}, seed {self.seed}", LONGEST_TITLE
        )

    @property
    def title(self) -> str:
        """The drive in one line that is safe to print."""
        return printable(
            f"{self.driver}: {self.scenario} at {self.speed_kmh:g} km/h in {Path(self.town).stem}/{self.scene}, seed"
            f" {self.seed}, {self.twin}",
            LONGEST_TITLE,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Cast:
    """A driver of the config, with the plugins that it names.

    Attributes:
        label: name of the driver.
        driver: its entry in the config.
        controller: the controller.
        task: name of the task whose cameras it has; "" without cameras.
        model: the network; None without one.
        defense: the defense; None without one.
    """

    label: str
    driver: Driver
    controller: Chosen
    task: str = ""
    model: Chosen | None = None
    defense: Chosen | None = None

    @property
    def spec(self) -> ControllerSpec[Any]:
        """The controller's spec."""
        spec = self.controller.found.spec
        assert isinstance(spec, ControllerSpec)
        return spec

    def facts(self) -> Json:
        """Names, versions and options of the driver's controller, network and defense, as JSON; they decide
        the drives.
        """
        return {
            "controller": self.controller.facts(),
            "task": self.task,
            "options": to_plain(self.driver.options),
            "model": None if self.model is None else self.model.facts(),
            "defense": None if self.defense is None else self.defense.facts(),
            "calibration": [self.driver.calibration, self.driver.calibration_patched],
        }


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Drives:
    """All drives of a study; plain data that is sent to each worker.

    Attributes:
        config: the config with all defaults filled in.
        library: the scenarios.
        casts: drivers by name.
        runs: the drives, in order; twins follow each other.
        root: folder of all results.
    """

    config: DriveConfig
    library: ScenarioLibrary
    casts: dict[str, Cast]
    runs: tuple[DriveRun, ...]
    root: Path

    def scenario(self, run: DriveRun) -> Scenario:
        """The scenario of the drive `run`, from the library."""
        return self.library.scenarios[run.scenario]

    def collection(self, run: DriveRun) -> CollectionConfig:
        """The collection config with which the pictures of a drive are rendered: the settings `collect` of the study,
        with the task, town and scene of the drive, and the weather and crowd of the study.

        Args:
            run: the drive.

        Raises:
            ConfigError: a key of `collect` cannot be read.
        """
        cast = self.casts[run.driver]
        place = Place("drive config")
        given = {"task": cast.task or NO_CAMERA_TASK, "town": run.town, "scene": run.scene}
        node = merged(
            self.config.collect,
            Mapping({key: (place, Scalar(text, False, place)) for key, text in given.items()}, place),
        )
        read = read_node(CollectionConfig, node, "collect")
        options = cast.driver.options if cast.task else Mapping({}, place)
        return replace(read, weather=self.config.weather, crowd=self.config.crowd, options=options, probes=False)

    def has_video(self, run: DriveRun) -> bool:
        """Whether the drive `run` leaves a video: the config asks for videos, and the driver has cameras."""
        return self.config.video and bool(self.casts[run.driver].task)

    def patch(self, run: DriveRun, surfaces: int) -> PatchSet:
        """The patch that the scene of a drive shows.

        Args:
            run: the drive; its twin decides which patch is shown.
            surfaces: number of the surfaces of the scene that can show patches.

        Raises:
            PatchError: the patch cannot be used.
        """
        cast = self.casts[run.driver]
        wanted = run.twin
        if run.twin == PATCH:
            model = "" if cast.model is None else cast.model.found.spec.name
            names = {"town": run.town, "scene": run.scene, "model": model}
            wanted = NAMES.sub(lambda found: names[found[1]], cast.driver.patch)
        return resolve_patch(wanted, surfaces=surfaces, seed=self.config.seed)

    def identity(self, run: DriveRun, patch: PatchSet) -> Json:
        """Everything that decides the bytes of a drive, except the renderer's device.

        Args:
            run: the drive.
            patch: the patch that its scene shows.

        Returns:
            Drive, driver, scenario, weather, crowd, collection settings, hash of the patch, and versions of packages,
            as JSON.
        """
        return {
            "run": to_json(run),
            "driver": self.casts[run.driver].facts(),
            "scenario": to_json(self.scenario(run)),
            "weather": to_plain(self.config.weather),
            "crowd": self.config.crowd,
            "collect": to_plain(self.config.collect),
            "patch": {"label": patch.label, "sha256": patch.digest},
            "versions": versions(),
            **({"open_loop": True} if self.config.open_loop else {}),
            **({} if self.config.dynamics == "kinematic" else {"dynamics": self.config.dynamics}),
        }

    def folder(self, run: DriveRun, patch: PatchSet) -> str:
        """Path of the folder of a drive, relative to the root. It contains a hash of all that decides the drive, so
        that changed settings give another folder.

        Args:
            run: the drive.
            patch: the patch that its scene shows.
        """
        digest = hashlib.sha256(dump_json(self.identity(run, patch))).hexdigest()[:8]
        place = f"{Path(run.town).stem}-{Path(run.scene).stem}"
        name = f"{run.scenario}-{run.speed_kmh:g}kmh-{place}-s{run.seed}-{run.twin}-{digest}"
        return f"{RUNS}/{run.driver}/{_safe(name)}"


def read_drive_config(config: str | Path, settings: Iterable[str] = ()) -> DriveConfig:
    """Reads a drive config.

    Args:
        config: name or path of the config.
        settings: `KEY=VALUE` texts that replace its values.

    Raises:
        GearError: the config does not exist, or cannot be read; the message is one line.
    """
    node = with_overrides(parse_file(find_config("drive", str(config))), settings, DriveConfig)
    return read_node(DriveConfig, node)


def plan_drives(config: DriveConfig, root: Path, device: str | None = None) -> Drives:
    """Finds everything that a config names, and lists the drives.

    Args:
        config: the config.
        root: folder of all results.
        device: device of the networks; None for the one in the config.

    Raises:
        GearError: a name is unknown, an option does not fit, a patch cannot be used, or a package is missing; the
            message is one line.
    """
    if config.video:
        check_video()
    with located_errors(config.places, "library"):
        library = load_scenarios(config.library)
    speeds = config.scenarios or dict.fromkeys(library.scenarios, ())
    for name in speeds:
        if name not in library.scenarios:
            error = UnknownNameError("scenario", name, library.scenarios)
            raise config.places["scenarios"].error(f"scenarios.{name}", str(error)) if config.scenarios else error
    casts = {label: _cast(label, driver, device) for label, driver in config.drivers.items()}
    drives = Drives(
        config=config,
        library=library,
        casts=casts,
        runs=tuple(_runs(config, library, speeds, casts)),
        root=root,
    )
    _check(drives)
    return drives


def _runs(
    config: DriveConfig, library: ScenarioLibrary, speeds: dict[str, tuple[float, ...]], casts: dict[str, Cast]
) -> Iterator[DriveRun]:
    for cast in casts.values():
        for town, scenes in config.towns.items():
            for scene in scenes:
                for name, given in speeds.items():
                    if library.scenarios[name].red_light and not config.scenarios and not _meets_lights(cast):
                        continue
                    for speed_kmh in given or library.scenarios[name].speeds_kmh:
                        for number in range(config.repeats):
                            for twin in _twins(config, cast):
                                yield DriveRun(
                                    driver=cast.label,
                                    town=town,
                                    scene=scene,
                                    scenario=name,
                                    speed_kmh=speed_kmh,
                                    seed=config.seed + number,
                                    twin=twin,
                                )


def _meets_lights(cast: Cast) -> bool:
    """Whether a driver takes part in scenarios with a red light that the config does not name: it reads lights, or it
    reads no task at all, like the blind driver and policies that drive end to end.
    """
    return cast.spec.reads_lights or not cast.spec.tasks


def _twins(config: DriveConfig, cast: Cast) -> list[str]:
    if not cast.task:
        return [NO_PATCH]
    return [twin for twin in config.twins if twin != PATCH or cast.driver.patch]


def _cast(label: str, driver: Driver, device: str | None) -> Cast:
    """Finds the plugins of a driver.

    Raises:
        GearError: a name is unknown, an option does not fit, or the plugins do not fit each other.
    """
    with located_errors(driver.places, "controller", f"drivers.{label}"):
        controller = Chosen(found=find("controller", driver.controller), options=driver.set)
    spec = controller.found.spec
    assert isinstance(spec, ControllerSpec)
    read_node(spec.config, driver.set, f"drivers.{label}.set")
    task = driver.task or (spec.tasks[0] if spec.tasks else "")
    if spec.tasks and task not in spec.tasks:
        raise GearError(f"driver {label}: controller {spec.name!r} reads {', '.join(spec.tasks)}, not {task}")
    if spec.tasks and not driver.model:
        raise GearError(f"driver {label}: controller {spec.name!r} needs a network; name one with `model`")
    if spec.needs_views and not task:
        raise GearError(f"driver {label}: controller {spec.name!r} needs pictures; name a task for its cameras")
    cast = Cast(label=label, driver=driver, controller=controller, task=task)
    if not task:
        return cast
    with located_errors(driver.places, "task", f"drivers.{label}"):
        found = find("task", task)
    options = to_plain(read_node(found.spec.config, driver.options, f"drivers.{label}.options"))
    return _with_model(cast, options, device) if driver.model else cast


def _with_model(cast: Cast, options: Json, device: str | None) -> Cast:
    driver, label = cast.driver, cast.label
    with located_errors(driver.places, "model", f"drivers.{label}"):
        found = find("model", driver.model)
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if cast.task not in spec.tasks:
        raise GearError(f"driver {label}: model {spec.name!r} does {', '.join(spec.tasks)}, not {cast.task}")
    node = driver.model_set
    if device is not None and any(name == "device" for name in spec.config.__dataclass_fields__):
        place = Place("--device")
        node = merged(node, Mapping({"device": (place, Scalar(device, False, place))}, place))
    read_node(spec.config, node, f"drivers.{label}.model_set")
    model = Chosen(found=found, options=node)
    check_optics(model, options, f"driver {label} takes pictures", f"drivers.{label}.model_set.")
    if not driver.defense:
        return replace(cast, model=model)
    with located_errors(driver.places, "defense", f"drivers.{label}"):
        defense = Chosen(found=find("defense", driver.defense), options=driver.defense_set)
    read_node(defense.found.spec.config, driver.defense_set, f"drivers.{label}.defense_set")
    check_defense(defense, model, cast.task, is_calibrated=bool(driver.calibration))
    return replace(cast, model=model, defense=defense)


def _check(drives: Drives) -> None:
    """Looks up all places and patches before the first drive.

    Raises:
        GearError: one of them cannot be used.
    """
    named: dict[tuple[str, str, str], Named] = {}
    for run in drives.runs:
        key = (drives.casts[run.driver].task, run.town, run.scene)
        if key not in named:
            named[key] = look_up(drives.collection(run))
        if run.twin != NO_PATCH:
            drives.patch(run, surface_count(named[key]))


def surface_count(named: Named) -> int:
    """Number of the surfaces of a scene that can show patches.

    Args:
        named: the objects that a collection config names.
    """
    return len(named.scene.boards) if named.scene.truck is None else 1


def patches_of(drives: Drives, runs: Sequence[DriveRun]) -> list[PatchSet]:
    """The patches that the scenes of drives show, in the order of the drives; each patch is read only once.

    Args:
        drives: the study.
        runs: the drives.
    """
    known: dict[tuple[str, str, str, str], PatchSet] = {}
    found = []
    for run in runs:
        key = (run.driver, run.town, run.scene, run.twin)
        if key not in known:
            known[key] = drives.patch(run, surface_count(look_up(drives.collection(run))))
        found.append(known[key])
    return found


def _safe(name: str) -> str:
    return "".join(character if character.isalnum() or character in "._-" else "_" for character in name)
