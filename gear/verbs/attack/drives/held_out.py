"""Judges finished patches by drives at seeds that the attack did not use."""

from __future__ import annotations

from collections.abc import Sequence

from gear.config.dump import to_yaml
from gear.contracts.executors import Outcome
from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.dataset.claims import clear_claims
from gear.dataset.executors.calibrations import ShownCalibrations
from gear.dataset.files import write_whole
from gear.dataset.guarded_paths import remove_empty_folders
from gear.dataset.layout import split_folder
from gear.driving.config import PATCH
from gear.driving.drives import Drives, patches_of
from gear.driving.statistics import Rate, compared, mean_known
from gear.driving.worker import CLAIMS, DriveResult, drive_all, read_result
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.values.serial import Json, to_json

CONFIG = "drive.yml"
"""Name of the file with the config of the held-out drives, with which `gear drive` makes their report."""


def evaluate_held_out(drives: Drives, callbacks: Callbacks) -> Json:
    """Makes the held-out drives that are missing, and summarises all of them.

    Args:
        drives: the held-out drives: each situation without a patch, with a random patch, and with the patches.
        callbacks: callbacks that receive the progress in drives, and warnings about drives that could not be made.

    Returns:
        `twins` (numbers of drives and crashes and mean measures of each twin), `against` (comparison of the patches
        with the other two twins: McNemar's test and differences), and `drives` (each result).

    Raises:
        GearError: a drive could not be made for another reason than a lack of place in the scene.
    """
    total, done = len(drives.runs), 0
    broken: list[str] = []

    calibrations = ShownCalibrations(callbacks=callbacks)

    def report(outcome: Outcome) -> None:
        nonlocal done
        if calibrations.takes(outcome):
            return
        done += 1
        if outcome.kind == "failed":
            line = f"held-out drive {drives.runs[outcome.index].title}: {outcome.error}"
            callbacks.on_warning(line)
            if not outcome.is_final:
                broken.append(line)
        callbacks.on_progress(done, total)

    write_whole(drives.root, CONFIG, to_yaml(drives.config).encode())
    callbacks.on_progress(0, total)
    drive_all(drives, iter(range(total)), report)
    clear_claims(drives.root, CLAIMS)
    remove_empty_folders(drives.root, split_folder(CLAIMS))
    if broken:
        raise GearError(f"{broken[0]}; run the same command again, which makes only what is missing")
    found = [
        read_result(drives.root, drives.folder(run, patch), drives.identity(run, patch))
        for run, patch in zip(drives.runs, patches_of(drives, drives.runs), strict=True)
    ]
    results = [one for one in found if one is not None]
    groups = {twin: [one for one in results if one.run.twin == twin] for twin in (NO_PATCH, RANDOM_PATCH, PATCH)}
    return {
        "twins": {twin: summary(group) for twin, group in groups.items()},
        "against": {twin: to_json(compared(groups[PATCH], groups[twin], twin)) for twin in (NO_PATCH, RANDOM_PATCH)},
        "drives": [to_json(one) for one in results],
    }


def summary(results: Sequence[DriveResult]) -> Json:
    """Numbers of drives, of crashes and of drives with phantom brakings, and means of measures.

    Args:
        results: the drives of one twin.
    """
    measures = [one.measures for one in results]
    crashes = Rate.of(one.is_crash for one in measures)
    return {
        "drives": crashes.total,
        "crashes": crashes.count,
        "interval": None if crashes.interval is None else list(crashes.interval),
        "phantoms": sum(one.phantom_brakings > 0 for one in measures),
        "least_ttc_s": mean_known(one.least_ttc_s for one in measures),
        "least_distance_m": mean_known(one.least_distance_m for one in measures),
        "impact_mps": mean_known(one.impact_mps for one in measures),
        "score": mean_known(one.score for one in measures),
    }
