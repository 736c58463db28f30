"""Drives a part of a record's drives again and compares the outcomes and the hashes of the logs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.executors import Outcome
from gear.dataset.executors.calibrations import ShownCalibrations
from gear.driving.config import DriveConfig
from gear.driving.drives import DriveRun, Drives, patches_of, plan_drives
from gear.driving.simulation import FRAME_S
from gear.driving.worker import DriveResult, drive_all, read_result
from gear.leaderboard.drive_claims import DriveClaim, Key
from gear.leaderboard.verdict import Finding, Level, finding
from gear.plugins.build import NO_OPTIONS
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.values.rng import derive_rng
from gear.verbs.bench.drives.recording import label_of
from gear.verbs.bench.drives.steps import PlannedDrives, planned_drives, settings
from gear.verbs.leaderboard.request import CheckRequest
from gear.verbs.leaderboard.rerun import Rerun

LEAST_EQUAL = 0.75
"""Smallest share of repeated drives that must end as in the record, on a machine that gives other bytes."""


MOST_SCORE_OFF = 1e-6
"""Largest difference of a driving score that is computed from an equal log."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Repeated:
    """One drive of the record's config.

    Attributes:
        planned: the drives of its scene.
        drives: the same drives, of the recorded network alone.
        number: number of the drive among them.
        run: the drive.
    """

    planned: PlannedDrives
    drives: Drives
    number: int
    run: DriveRun

    @property
    def key(self) -> Key:
        """What identifies the drive in a record."""
        run, planned = self.run, self.planned
        return planned.scene.label, planned.weather, run.scenario, run.speed_kmh, run.seed, planned.kind(run.twin)

    @property
    def title(self) -> str:
        """The drive in a few words."""
        scene, weather, scenario, speed_kmh, seed, patch = self.key
        where = f"{scene}, {weather}" if weather else scene
        return f"drive {scenario} at {speed_kmh:g} km/h in {where}, seed {seed}, {patch}"

    @property
    def is_free(self) -> bool:
        """Whether nothing is in the way of the car."""
        return self.drives.scenario(self.run).is_free


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivesToRepeat:
    """The drives of a record that a check makes again.

    Attributes:
        chosen: the drives.
        total: number of the drives that the record's config makes.
        problems: why no drive is made again; empty if drives are made again, or if there are none.
    """

    chosen: tuple[Repeated, ...] = ()
    total: int = 0
    problems: tuple[Finding, ...] = ()


def chosen_drives(rerun: Rerun, request: CheckRequest) -> DrivesToRepeat:
    """Chooses the drives that a check makes again. Nothing is rendered, so that too many drives are refused at once.

    Args:
        rerun: the record on this machine.
        request: arguments of the check: the number of drives, and the seed by which they are chosen.

    Raises:
        GearError: a patch is missing, something does not fit, or the check would render too many pictures.
    """
    every = list(_every(rerun))
    claimed = {one.key for one in rerun.record.drives}
    if not every and not claimed:
        return DrivesToRepeat()
    unknown = claimed - {one.key for one in every}
    if unknown:
        return _unusable(f"drives: {len(unknown)} of the record's drives are not part of its config")
    if not claimed:
        return _unusable("drives: the record's config has drives, but the record states none")
    chosen = _chosen(every, request)
    frames = sum(_frames(one) for one in chosen)
    if frames > request.most_pictures:
        problem = f"{len(chosen)} drives would render up to {frames} pictures, at most {request.most_pictures} are"
        raise GearError(f"{request.record}: {problem} allowed; raise --most-pictures, or lower --drives")
    return DrivesToRepeat(chosen=tuple(chosen), total=len(every))


def _unusable(problem: str) -> DrivesToRepeat:
    return DrivesToRepeat(problems=(finding("differs", problem),))


def check_drives(rerun: Rerun, drives: DrivesToRepeat, callbacks: Callbacks, *, is_same: bool) -> list[Finding]:
    """Makes some of the drives of a record again.

    Args:
        rerun: the record on this machine.
        drives: the drives that are made again (`chosen_drives`).
        callbacks: callbacks that receive the progress of calibrations.
        is_same: whether this machine should give equal bytes.

    Returns:
        The findings; none for a record without drives whose config has none.

    Raises:
        DatasetError: a file cannot be written.
    """
    if drives.problems or not drives.total:
        return list(drives.problems)
    claimed = {one.key: one for one in rerun.record.drives}
    made = [(one, _driven(one, callbacks)) for one in drives.chosen]
    return list(_compared(made, claimed, drives.total, is_same=is_same))


def _every(rerun: Rerun) -> Iterator[Repeated]:
    """All drives of the recorded network that its config makes; their patches are put where they are looked for."""
    for planned in planned_drives(rerun.plan):
        label = label_of(planned, rerun.planned)
        if label is None:
            continue
        driver = planned.config["drivers"][label]
        rerun.place_patches(Path(driver["patch"]))
        config = settings({**planned.config, "drivers": {label: driver}})
        drives = plan_drives(read_node(DriveConfig, with_overrides(NO_OPTIONS, config)), planned.out.absolute())
        for number, run in enumerate(drives.runs):
            yield Repeated(planned=planned, drives=drives, number=number, run=run)


def _chosen(every: Sequence[Repeated], request: CheckRequest) -> list[Repeated]:
    """Draws the drives that are repeated."""
    drawn = derive_rng(request.seed, "leaderboard", "drives").permutation(len(every))[: request.drives]
    return [every[number] for number in sorted(int(one) for one in drawn)]


def _frames(one: Repeated) -> int:
    """The largest number of pictures of a drive."""
    return round(one.drives.scenario(one.run).duration_s / FRAME_S)


def _driven(one: Repeated, callbacks: Callbacks) -> DriveResult | str:
    """Drives again; the reason in one line if the drive cannot be made.

    Raises:
        DatasetError: a file cannot be written.
    """
    outcomes: list[Outcome] = []
    calibrations = ShownCalibrations(callbacks=callbacks)

    def report(outcome: Outcome) -> None:
        if not calibrations.takes(outcome):
            outcomes.append(outcome)

    one.drives.root.mkdir(parents=True, exist_ok=True)
    drive_all(one.drives, iter([one.number]), report)
    (patch,) = patches_of(one.drives, [one.run])
    found = read_result(one.drives.root, one.drives.folder(one.run, patch), one.drives.identity(one.run, patch))
    return found if found is not None else next((each.error for each in outcomes if each.error), "was not made")


def _compared(
    made: Sequence[tuple[Repeated, DriveResult | str]],
    claimed: Mapping[Key, DriveClaim],
    total: int,
    *,
    is_same: bool,
) -> Iterator[Finding]:
    """Yields the findings about repeated drives."""
    ends: list[bool] = []
    equal = 0
    for one, here in made:
        there = claimed.get(one.key)
        if isinstance(here, str):
            if there is not None:
                yield finding("differs", f"{one.title}: cannot be driven here ({here}), the record has its outcome")
            continue
        if there is None:
            yield finding("differs", f"{one.title}: can be driven here, but the record leaves it out")
            continue
        equal += here.log_sha256 == there.log_sha256
        is_end = here.measures.is_crash == there.is_crash and one.is_free == there.is_free
        ends.append(is_end)
        is_score = abs(here.measures.score - there.score) <= MOST_SCORE_OFF
        if is_same and here.log_sha256 != there.log_sha256:
            yield finding("differs", f"{one.title}: another log than in the record, on the same kind of machine")
        elif is_same and not (is_end and is_score):
            yield finding("differs", f"{one.title}: the outcome in the record is not that of its log")
        elif not is_end:
            yield finding("note", f"{one.title}: {_end(here)}, the record says otherwise")
    if ends and sum(ends) < LEAST_EQUAL * len(ends):
        yield finding("differs", f"drives: only {sum(ends)} of {len(ends)} end as the record says")
    level: Level = "same" if equal == len(made) else "note"
    yield finding(level, f"drives: {len(made)} of {total} driven again, {equal} of them with an equal log")


def _end(here: DriveResult) -> str:
    return "crashed" if here.measures.is_crash else f"ended without a crash ({here.measures.ending})"
