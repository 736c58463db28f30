"""`gear.drive`: drives cars through scenarios with and without patches, and writes one report."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from gear.collecting.job import versions
from gear.collecting.patch_sources import PatchSet
from gear.collecting.workers import Workers, fitting_workers
from gear.config.dump import to_plain, to_yaml
from gear.contracts.executors import Executor, Needs, Outcome
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import NO_PATCH
from gear.dataset.claims import clear_claims
from gear.dataset.disk_and_time_forecast import Forecast
from gear.dataset.executors.engines import DEFAULT, open_executor
from gear.dataset.executors.jobs import JobNotes, try_jobs
from gear.dataset.files import clear_scratch, inside, read_bytes, write_whole
from gear.dataset.free_space import tree_bytes
from gear.dataset.guarded_paths import remove_empty_folders
from gear.dataset.json_text import dump_json
from gear.dataset.layout import split_folder
from gear.dataset.own_output import check_own
from gear.dataset.store import check_output
from gear.driving.drives import RUNS, DriveRun, Drives, patches_of, plan_drives, read_drive_config
from gear.driving.worker import CLAIMS, RESULT, UNREADABLE, DriveResult, drive_all, read_log, read_result
from gear.measuring.shown_size import focal_note
from gear.plugins.build import find
from gear.reporting.display import displayed
from gear.values.counted import counted
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.verbs.drive.chart import chart
from gear.verbs.drive.metric_against_outcome import metric_of
from gear.verbs.drive.page import page
from gear.verbs.drive.report import DriveReport
from gear.verbs.drive.request import DriveRequest
from gear.verbs.drive.table import text
from gear.verbs.drive.twin_videos import write_twin_videos

LONGEST_DRIVE_S = 7200.0
"""Time without a message after which a worker counts as hung, seconds: a drive of two minutes has 1200 frames, and the
first one of a place compiles its world.
"""

MOST_FIGURES = 12
"""Largest number of situations whose twins are drawn in the report."""

CONFIG = "drive.yml"
"""Name of the file with the config, with all defaults filled in."""

HEAD = b"# written by gear drive\n"
"""First line of that file, by which a folder of drives is recognised."""


def drive(
    config: str | Path,
    *,
    out: str | Path,
    settings: Iterable[str] = (),
    device: str | None = None,
    workers: Workers = 1,
    engine: str = DEFAULT,
    address: str | None = None,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> DriveReport:
    """Drives cars in the closed loop, with and without patches. Resumes an interrupted study drive by drive.

    Ten times per second a picture is rendered, the network predicts, the controller decides, and the car and all other
    road users move. Each drive depends only on the config and its seed.

    The folder `out` gets `report.html`, `table.txt`, `drives.csv` (one line per drive), `drive.json`, `drive.yml` (the
    config with all defaults filled in), and the folder `drives` with a log of each drive. With `video: true`, each
    drive of a driver with cameras also leaves a video, and the folder `videos` has the twins of each situation beside
    each other.

    Args:
        config: name (`gear drive quick`) or path of a drive config.
        out: folder of all results.
        settings: `KEY=VALUE` texts for any key of the config.
        device: device of the networks; overrides the config.
        workers: number of drives at the same time, or `auto`; the results do not depend on it.
        engine: engine that makes the drives: `processes`, `ray` or `slurm`.
        address: address of the engine's cluster; None without a cluster.
        progress: shows a progress bar.
        on_progress: called after every drive.
        on_fit_progress: called after every calibration sample that a defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called with lines on drives that could not be made.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = DriveRequest(
        config=config,
        out=out,
        settings=tuple(settings),
        device=device,
        workers=workers,
        engine=engine,
        address=address,
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "drive", progress=progress, unit="drive") as shown:
        return run_drive(request, shown)


def prepared(request: DriveRequest) -> Drives:
    """Reads the config and looks up everything that it names; nothing is driven.

    Args:
        request: the arguments of `gear.drive`.

    Raises:
        GearError: something in the config does not exist, does not fit, or cannot be read.
    """
    root = Path(request.out)
    check_output(root, "write the drives into a folder of their own")
    check_own(root, CONFIG, _is_ours, "drives")
    return plan_drives(read_drive_config(request.config, request.settings), root.absolute(), request.device)


def run_drive(request: DriveRequest, callbacks: Callbacks) -> DriveReport:
    """Runs a study with the arguments in `request`, which `gear.drive` describes. Results and pages are written into
    the folder `request.out`; finished drives are not repeated.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct, or a drive could not be made; the message is one line.
    """
    drives = prepared(request)
    executor = _executor(request)
    for label, cast in drives.casts.items():
        note = None
        if cast.model is not None:
            note = focal_note(cast.model, cast.task, cast.driver.options, f"driver {label}")
        if note is not None:
            callbacks.on_warning(note)
    write_whole(drives.root, CONFIG, HEAD + to_yaml(drives.config).encode())
    outcomes = _made(drives, executor, callbacks)
    clear_claims(drives.root, CLAIMS)
    remove_empty_folders(drives.root, split_folder(CLAIMS))
    results, failed = _gathered(drives, outcomes, callbacks.part("reading the results of all drives"))
    if not results:
        raise GearError(f"{drives.root}: no drive could be made ({failed[0][1] if failed else 'there are none'})")
    report = DriveReport(
        out=Path(request.out),
        results=tuple(results),
        failed=tuple(failed),
        facts={"config": to_plain(drives.config), "versions": versions()},
        free=frozenset(name for name, one in drives.library.scenarios.items() if one.is_free),
        errors=frozenset(label for label, cast in drives.casts.items() if cast.task and _is_error(cast.task)),
    )
    figures = _figures(drives, results, callbacks.part("drawing figures"))
    videos = write_twin_videos(drives, results, callbacks.part("writing videos of twins"))
    callbacks.part("writing tables and the report")
    for name, data in (
        ("drives.csv", _csv(report)),
        ("drive.json", dump_json(report.as_json())),
        ("table.txt", text(report).encode()),
        ("report.html", page(report, figures, videos).encode()),
    ):
        write_whole(drives.root, name, data)
    clear_scratch(drives.root)
    broken = [one for one in outcomes.values() if one.kind == "failed" and not one.is_final]
    if broken:
        first = broken[0]
        raise GearError(
            f"{drives.root}: {len(broken)} of {counted(len(drives.runs), 'drive')} could not be made"
            f" ({drives.runs[first.index].title}: {first.error}); the report has the others; put the cause right and"
            " run the same command again, which makes only what is missing"
        )
    return report


def _is_ours(path: Path) -> bool:
    """Whether gear wrote the config `path` of a study. The first line is missing in older folders, which hold a result
    of each drive.
    """
    return read_bytes(path).startswith(HEAD) or next(path.parent.glob(f"{RUNS}/*/*/{RESULT}"), None) is not None


def _is_error(task: str) -> bool:
    """Whether the main metric of a task is an error, so that a larger value is worse."""
    spec = find("task", task).spec
    return isinstance(spec, TaskSpec) and spec.lower_is_better


def _executor(request: DriveRequest) -> Executor:
    count, needs = fitting_workers(request.workers), Needs(silence_s=LONGEST_DRIVE_S)
    return open_executor(request.engine, workers=count, backend="drive", address=request.address, needs=needs)


def _made(drives: Drives, executor: Executor, callbacks: Callbacks) -> dict[int, Outcome]:
    """Makes the missing drives; a drive that fails for an unexpected reason is tried again twice.

    Returns:
        The last outcomes by index of the drive, without those of drives never begun.
    """
    patches = patches_of(drives, drives.runs)
    missing, checked = [], callbacks.part("checking existing drives")
    for index, (run, patch) in enumerate(zip(drives.runs, patches, strict=True)):
        if _stored(drives, run, patch, with_video=drives.has_video(run)) is None:
            missing.append(index)
        checked(index + 1, len(drives.runs))
    advice = "make fewer drives, without `video: true`, or give --out on another disk"
    forecast = Forecast(drives.root, len(missing), callbacks.on_warning, unit="drive", advice=advice)
    total = len(drives.runs)
    done, outcomes = total - len(missing), dict[int, Outcome]()
    callbacks.on_progress(done, total)

    def report(outcome: Outcome) -> None:
        outcomes[outcome.index] = outcome
        if outcome.kind == "failed":
            callbacks.on_warning(f"{drives.runs[outcome.index].title}: {outcome.error}")
        callbacks.on_progress(done + len(outcomes), total)
        if outcome.kind == "made":
            folder = drives.folder(drives.runs[outcome.index], patches[outcome.index])
            forecast.item_done(lambda: tree_bytes(inside(drives.root, folder)))

    notes = JobNotes(root=drives.root, names=[run.title for run in drives.runs])
    try_jobs(executor, partial(drive_all, drives), missing, report, callbacks=callbacks, notes=notes)
    return outcomes


def _stored(drives: Drives, run: DriveRun, patch: PatchSet, *, with_video: bool = False) -> DriveResult | None:
    return read_result(drives.root, drives.folder(run, patch), drives.identity(run, patch), with_video=with_video)


def _gathered(
    drives: Drives, outcomes: dict[int, Outcome], on_progress: Progress
) -> tuple[list[DriveResult], list[tuple[str, str]]]:
    """The results of all finished drives, and title and problem of the others."""
    results, failed = [], []
    for index, (run, patch) in enumerate(zip(drives.runs, patches_of(drives, drives.runs), strict=True)):
        result = _stored(drives, run, patch)
        if result is not None:
            results.append(result)
        else:
            failed.append((run.title, _problem(outcomes.get(index))))
        on_progress(index + 1, len(drives.runs))
    return results, failed


def _problem(outcome: Outcome | None) -> str:
    """Why a drive has no result.

    Args:
        outcome: the outcome of the drive; None if no worker has begun it.
    """
    if outcome is None:
        return "not begun, because too many drives in a row had failed; run the command again"
    return outcome.error or "another run is making it; run the command again"


def _figures(drives: Drives, results: list[DriveResult], on_progress: Progress) -> list[tuple[str, bytes]]:
    """Charts of the first situations of each driver, those whose twins ended differently first, each with a title."""
    groups: dict[tuple[str, tuple[str, str, str, float, int]], list[DriveResult]] = {}
    for one in results:
        groups.setdefault((one.run.driver, one.run.situation), []).append(one)
    several = [group for group in groups.values() if len(group) > 1]
    several.sort(key=lambda group: len({one.measures.is_crash for one in group}) == 1)
    figures, drawn_first = [], several[:MOST_FIGURES]
    for group in drawn_first:
        run = group[0].run
        patches = patches_of(drives, [one.run for one in group])
        logs = {
            one.run.twin: read_log(drives.root, drives.folder(one.run, patch))
            for one, patch in zip(group, patches, strict=True)
        }
        try:
            drawn = chart(logs)
        except UNREADABLE as error:  # a log that has the right hash, and that gear did not write
            raise DatasetError(
                drives.root / RUNS,
                f"holds a damaged log of {run.title}; delete the folder of the drive and drive again",
            ) from error
        figures.append((run.title.rsplit(",", 1)[0], drawn))
        on_progress(len(figures), len(drawn_first))
    return figures


def _csv(report: DriveReport) -> bytes:
    """One line per drive: what it is, its measures, the delay of its first braking against the twin `none`, the metric
    over its pictures, and the hash of its log.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    first = report.results[0]
    names = [field.name for field in dataclasses.fields(first.run)]
    measured = [field.name for field in dataclasses.fields(first.measures)]
    further = ["braking_delay_s", "open_loop_metric", "open_loop", "log_sha256"]
    writer.writerow([*names, "patch", "patch_sha256", *measured, *further])
    clean = {
        (one.run.driver, one.run.situation): one.measures.braking_s
        for one in report.results
        if one.run.twin == NO_PATCH
    }
    for one in report.results:
        before, after = clean.get((one.run.driver, one.run.situation)), one.measures.braking_s
        delay_s = None if before is None or after is None else after - before
        values = [getattr(one.measures, name) for name in measured]
        row = [
            *(getattr(one.run, name) for name in names), one.patch, one.patch_sha256, *values, delay_s,
            one.open_loop_metric, metric_of(one), one.log_sha256,
        ]  # fmt: skip
        writer.writerow(["" if value is None else value for value in row])
    return out.getvalue().encode()
