"""The drives of a benchmark in its records: outcome and hash of the log of each drive of a network."""

from __future__ import annotations

from gear.leaderboard.drive_claims import DriveClaim
from gear.leaderboard.record import Plugin
from gear.measuring.plugin_selection import Chosen
from gear.plugins.build import NO_OPTIONS, find
from gear.verbs.bench.drives.results import DriveSection
from gear.verbs.bench.drives.steps import PlannedDrives, planned_drives
from gear.verbs.bench.plan import Plan, PlannedEvaluation
from gear.verbs.bench.plugin_facts import plugin_facts


def label_of(planned: PlannedDrives, evaluation: PlannedEvaluation) -> str | None:
    """The name of the driver that is a recorded network with its defense; None if it is not among the drives.

    Args:
        planned: drives of one task in one scene and weather.
        evaluation: the recorded network, with its defense if it has one.
    """
    if planned.task_plugins.name != evaluation.task_plugins.name:
        return None
    defense = None if evaluation.defense is None else evaluation.defense.label
    wanted = (evaluation.model.label, defense)
    return next((label for label, one in planned.drivers.items() if (one.model, one.defense) == wanted), None)


def drive_claims(section: DriveSection | None, evaluation: PlannedEvaluation) -> tuple[DriveClaim, ...]:
    """The drives of a recorded network; empty if the benchmark has none.

    Args:
        section: all drives of the benchmark.
        evaluation: the recorded network, with its defense if it has one.
    """
    if section is None:
        return ()
    return tuple(
        DriveClaim(
            scene=planned.scene.label,
            weather=planned.weather,
            scenario=one.run.scenario,
            speed_kmh=one.run.speed_kmh,
            seed=one.run.seed,
            patch=planned.kind(one.run.twin),
            is_free=one.run.scenario in report.free,
            is_crash=one.measures.is_crash,
            score=one.measures.score,
            log_sha256=one.log_sha256,
        )
        for planned, report in section.made
        if (label := label_of(planned, evaluation)) is not None
        for one in report.results
        if one.run.driver == label
    )


def controller_facts(plan: Plan, evaluation: PlannedEvaluation) -> Plugin | None:
    """Facts about the controller that drives with a recorded network; None without drives.

    Args:
        plan: plan of the benchmark.
        evaluation: the recorded network, with its defense if it has one.

    Raises:
        GearError: the plugin is not installed.
    """
    for planned in planned_drives(plan):
        label = label_of(planned, evaluation)
        if label is not None:
            found = find("controller", planned.drivers[label].controller)
            return plugin_facts(Chosen(found=found, options=NO_OPTIONS))
    return None
