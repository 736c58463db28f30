"""`gear.bench`: collects pictures, optimises patches, evaluates networks and defenses, and writes one report."""

from __future__ import annotations

import contextlib
import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gear.collecting.job import versions
from gear.collecting.lookup import find_weather
from gear.collecting.workers import Workers, fitting_workers
from gear.config.dump import to_plain, to_yaml
from gear.config.load import find_config, load_collection
from gear.config.nodes import Node, parse_file
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.executors import Executor, Needs
from gear.contracts.loggers import LoggedRun
from gear.contracts.specs import AttackSpec
from gear.dataset.executors.engines import DEFAULT, open_engine
from gear.dataset.files import clear_scratch, write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.locks import exclusive_lock
from gear.dataset.store import check_output
from gear.leaderboard.record import Kind
from gear.measuring.plugin_selection import check_optics
from gear.measuring.run_log import FOLDER, RunLog, choose_logger
from gear.networks.runtime import has_cuda
from gear.reporting.advice import fitted
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.verbs.bench.all_metrics import COLUMNS as METRIC_COLUMNS
from gear.verbs.bench.all_metrics import metric_records
from gear.verbs.bench.carry_out import carry_out
from gear.verbs.bench.chart import chart
from gear.verbs.bench.config import BenchConfig, settings_of
from gear.verbs.bench.disk import PictureSpace
from gear.verbs.bench.drives.results import COLUMNS as DRIVE_COLUMNS
from gear.verbs.bench.drives.results import DriveSection, drive_section
from gear.verbs.bench.drives.steps import check_drives, every_step, planned_drives
from gear.verbs.bench.existing_patches import PATCHES, ExistingPatches
from gear.verbs.bench.page import page
from gear.verbs.bench.paper.latex import document, tabular
from gear.verbs.bench.paper.tables import paper_tables
from gear.verbs.bench.plan import Plan, PlannedEvaluation, Step
from gear.verbs.bench.recording import write_records
from gear.verbs.bench.report import COLUMNS, BenchReport, Metric, Result, SceneMetric, TaskResult
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run_log import log_report, with_log
from gear.verbs.bench.scenes import calibration_scene, located, measured_scenes
from gear.verbs.bench.schedule import OnStep, run_steps
from gear.verbs.bench.table import text
from gear.verbs.bench.validation import check_collect, find_attack, plugins_of_tasks
from gear.verbs.drive.report import DriveReport
from gear.verbs.evaluate.report import EvaluateReport

Reports = dict[str, EvaluateReport | DriveReport]
"""Reports of the steps that evaluate or drive, by their folder."""

CONFIG = "bench.yml"
"""Name of the file with the bench config, with all defaults filled in."""


def bench(
    config: str | Path,
    *,
    out: str | Path,
    settings: Iterable[str] = (),
    device: str | None = None,
    engine: str = DEFAULT,
    address: str | None = None,
    workers: Workers = 1,
    in_subprocess: bool = False,
    record: Kind | bool = False,
    log_to: str | None = None,
    log_settings: Iterable[str] = (),
    progress: bool = False,
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> BenchReport:
    """Compares networks and defenses over scenes and patches: collects pictures, makes patches and evaluates. Resumes
    an interrupted run.

    The folder `out` gets `report.html`, `table.txt`, `bench.csv` (one line per metric), `bench.json` and charts in
    `figures`; the folders `data`, `patches` and `evaluations` of the other verbs; and `bench.yml`, the config with all
    defaults filled in. With the key `drives`, it also gets `drives.csv` and the folder `drives` of `gear.drive`.

    Args:
        config: name (`gear bench quick`) or path of a bench config.
        out: folder of all results.
        settings: `KEY=VALUE` texts for any key of the config.
        device: device of the networks; overrides the config.
        engine: name of the engine whose workers carry out the steps; `processes` uses processes on this machine.
        address: address of the engine's cluster: a Ray cluster, or a partition of SLURM.
        workers: number of workers of the engine, or `auto`. With more than one worker, or another engine, several
            steps are carried out at the same time; a script then needs `if __name__ == "__main__":`. On a machine with
            a GPU, `processes` carries out one attack or evaluation at a time.
        in_subprocess: whether a single worker runs in a process of its own. Each collection in the calling process
            keeps about 20 MB, so True is better for large benches; a script then needs `if __name__ == "__main__":`.
        record: whether records for a leaderboard are written into `records`; a name (`attack`) sets their kind.
        log_to: name of a logger plugin, such as `tensorboard`: attacks log their curves in the folders of their
            patches, and the results are logged in `out/log`; None for no log.
        log_settings: `KEY=VALUE` texts for the logger's options.
        progress: shows a progress bar.
        on_step: called with a step, its number (from 1) and the number of steps: before each step, or after each step
            if several are carried out at the same time.
        on_progress: called after every sample of a step, or after every step of an attack; if several steps are carried
            out at the same time, after each of them.
        on_fit_progress: called after every calibration sample that a defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called with lines on settings that may be unintended, and on results that are made again.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = BenchRequest(
        config=config,
        out=out,
        settings=tuple(settings),
        device=device,
        workers=workers,
        in_subprocess=in_subprocess,
        engine=engine,
        address=address,
        record=record,
        log_to=log_to,
        log_settings=tuple(log_settings),
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "bench", progress=progress) as shown:
        return run_bench(request, shown, on_step)


def run_bench(request: BenchRequest, callbacks: Callbacks, on_step: OnStep | None = None) -> BenchReport:
    """Runs a benchmark with the arguments in `request`, which `gear.bench` describes.

    Args:
        request: arguments of the benchmark.
        callbacks: progress and warnings.
        on_step: called at the start of each step; None for no calls.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    logger = choose_logger(request.log_to, request.log_settings)
    plan, root = prepared(request), Path(request.out)
    if plan.config.sweep is not None:
        raise GearError(f"{request.config}: sweeps {plan.config.sweep.key}; gear.sweep runs it, or say sweep=")
    config = to_yaml(plan.config).encode()
    run = LoggedRun(verb="bench", title=request.name, folder=root / FOLDER)
    log = RunLog(logger, run, callbacks.on_warning)
    with exclusive_lock(root, callbacks.on_warning), contextlib.closing(log):
        if not (root / CONFIG).exists():  # an existing config belongs to the existing reports
            write_whole(root, CONFIG, config)
        steps = with_log(every_step(plan), request)
        carried_out = _scheduled if request.is_scheduled else _in_turn
        report = _report(plan, root, request, carried_out(steps, root, request, callbacks, on_step))
        write_whole(root, CONFIG, config)
        _write(report, plan, root)
        if request.record:
            kind = None if request.record is True else request.record
            write_records(report, plan, request.name, kind)
        log_report(log, report)
    return report


def _in_turn(
    steps: Sequence[Step], root: Path, request: BenchRequest, callbacks: Callbacks, on_step: OnStep | None
) -> Reports:
    """Carries out all steps in this process, one after the other; returns the reports by their folder."""
    evaluations: Reports = {}
    space = PictureSpace(steps, root, callbacks.on_warning)
    for number, step in enumerate(steps, 1):
        if on_step is not None:
            on_step(step, number, len(steps))
        changed = {"in_subprocess": request.in_subprocess} if step.verb == "collect" else {}
        done = carry_out(step, root, callbacks, changed=changed)
        if isinstance(done, (EvaluateReport, DriveReport)):
            evaluations[step.arguments["out"]] = done
        space.step_done(step)
    return evaluations


def _scheduled(
    steps: Sequence[Step], root: Path, request: BenchRequest, callbacks: Callbacks, on_step: OnStep | None
) -> Reports:
    """Carries out all steps with the workers of an engine; returns the reports by their folder."""
    workers, has_gpu = fitting_workers(request.workers), has_cuda(request.device)
    return run_steps(
        steps,
        root,
        rendering=_engine(request, workers),
        networks=_engine(request, 1 if has_gpu and request.engine == DEFAULT else workers, gpus=int(has_gpu)),
        workers=workers,
        callbacks=callbacks,
        on_step=on_step,
    )


def _engine(request: BenchRequest, workers: int, *, gpus: int = 0) -> Executor:
    """Opens the engine that carries out steps; a step may take any time."""
    needs = Needs(silence_s=math.inf, gpus=gpus)
    return open_engine(request.engine, workers=workers, backend="bench", address=request.address, needs=needs)


def _write(report: BenchReport, plan: Plan, root: Path) -> None:
    """Writes the reports into the folder of the bench."""
    write_whole(root, "bench.csv", _csv(COLUMNS, report.records()))
    write_whole(root, "bench.json", dump_json(report.as_json()))
    metrics = list(metric_records(report))
    write_whole(root, "metrics.csv", _csv(METRIC_COLUMNS, metrics))
    write_whole(root, "metrics.json", dump_json(metrics))
    tables = paper_tables(report)
    if report.drives is not None:
        write_whole(root, "drives.csv", _csv(DRIVE_COLUMNS, (line.record() for line in report.drives.lines)))
    for one in tables:
        write_whole(root, f"tables/{one.name}.tex", tabular(one).encode())
    write_whole(root, "tables/tables.tex", document(tables, report.title).encode())
    write_whole(root, "table.txt", text(report).encode())
    for task, task_plugins in zip(report.tasks, plan.plugins_of_tasks, strict=True):
        if task.metric is not None:
            write_whole(root, f"figures/{task_plugins.folder}.pdf", chart(task, "pdf"))
    write_whole(root, "report.html", page(report, plan).encode())
    clear_scratch(root)


def _csv(columns: Sequence[str], records: Iterable[Mapping[str, Any]]) -> bytes:
    """Encodes flat records as CSV with a line of titles."""
    written = io.StringIO()
    table = csv.DictWriter(written, columns, lineterminator="\n")
    table.writeheader()
    table.writerows(records)
    return written.getvalue().encode()


def prepared(request: BenchRequest) -> Plan:
    """Reads and checks a bench config and returns its plan; nothing is written.

    Args:
        request: the arguments of `gear.bench`.

    Raises:
        GearError: something in the config does not exist, does not fit, or cannot be read.
    """
    root = Path(request.out)
    check_output(root, "write the bench into a folder of its own")
    node = with_overrides(parse_file(find_config("bench", str(request.config))), request.settings, BenchConfig)
    read = read_node(BenchConfig, node)
    scenes = measured_scenes(read, node)
    attacker = find_attack(read, node)
    assert isinstance(attacker.spec, AttackSpec)
    surfaces = max(scene.surfaces for scene in scenes)
    existing = _existing_patches(read, node, request)
    plan = Plan(
        read,
        scenes=scenes,
        calibration=calibration_scene(read, node, scenes),
        plugins_of_tasks=tuple(plugins_of_tasks(read, node, attack=attacker, surfaces=surfaces, device=request.device)),
        attack=attacker.spec,
        root=root,
        workers=_workers(request),
    )
    plan.take_existing(existing)
    _check_pictures(plan, node)
    check_drives(plan, node)
    return plan


def _existing_patches(config: BenchConfig, node: Node, request: BenchRequest) -> ExistingPatches:
    """Returns the source of patches that the benchmark uses in place of attacks.

    Raises:
        ConfigError: the source holds no patches, or records are wanted, which state what the benchmark's attack did.
    """
    try:
        if config.attack.patches and request.record:
            raise GearError("records state what the attack of their benchmark did; leave out --record or this key")
        return ExistingPatches(config.attack.patches)
    except GearError as error:
        raise located(node, error, "attack", "patches") from error


def _workers(request: BenchRequest) -> dict[str, str | int]:
    """Returns the arguments of collections that name their workers; default values are left out, except the number.

    Raises:
        UnknownNameError: there is no such engine.
        GearError: the engine cannot use the address, or a package that it needs is not installed.
    """
    count = fitting_workers(request.workers)
    _engine(request, count)
    engine = {} if request.engine == DEFAULT else {"engine": request.engine}
    address = {} if request.address is None else {"address": request.address}
    return {"workers": count, **engine, **address}


def _check_pictures(plan: Plan, node: Node) -> None:
    """Checks the collection settings and task options of all tasks before the first step runs.

    Raises:
        ConfigError: a key cannot be read or is decided by the benchmark, a weather is unknown, or a network expects
            another camera.
    """
    for task_plugins in plan.plugins_of_tasks:
        own = plan.config.tasks[task_plugins.name].collect
        for collect, key in ((plan.config.collect, ("collect",)), (own, ("tasks", task_plugins.name, "collect"))):
            try:
                check_collect(task_plugins.name, settings_of(collect))
            except GearError as error:
                raise located(node, error, *key) from error
        for weather in plan.weathers:
            settings = (*plan.picture_settings(task_plugins), *weather.settings)
            try:
                config = load_collection(None, {"task": task_plugins.name}, settings)
                options = to_plain(read_node(task_plugins.task.config, config.options, "options"))
                find_weather(config.weather)
            except GearError as error:
                raise located(node, error, "tasks", task_plugins.name, "collect") from error
        for model in task_plugins.models:
            at = ("tasks", task_plugins.name, "models", model.label)
            try:
                check_optics(model.chosen, options, "pictures are collected", f"--set {'.'.join(at)}.set.")
            except GearError as error:
                raise located(node, error, *at) from error


def _report(plan: Plan, root: Path, request: BenchRequest, reports: Reports) -> BenchReport:
    evaluations = {out: one for out, one in reports.items() if isinstance(one, EvaluateReport)}
    tasks = []
    for task_plugins in plan.plugins_of_tasks:
        spec = task_plugins.task
        metric = Metric.of(spec.metric, lower_is_better=spec.lower_is_better) if spec.metric else None
        results = [
            _result(planned, metric, evaluations[str(planned.out)], plan)
            for planned in plan.planned_evaluations(task_plugins)
        ]
        tasks.append(TaskResult(name=task_plugins.name, metric=metric, results=tuple(results)))
    said = (note for task in tasks for one in task.results for note in one.evaluation.facts.get("notes", []))
    notes = [fitted("bench", note) for note in said]
    facts = {
        "config": to_plain(plan.config),
        "scenes": [scene.label for scene in plan.scenes],
        "existing_patches": [own.relative_to(root / PATCHES).as_posix() for own in plan.existing],
        "weathers": [weather.label for weather in plan.weathers],
        "name": request.name,
        "command": request.command,
        "seed": plan.config.seed,
        "versions": versions(),
        "notes": list(dict.fromkeys(notes)),
    }
    return BenchReport(out=root, facts=facts, tasks=tuple(tasks), drives=_drives(plan, root, reports))


def _drives(plan: Plan, root: Path, reports: Reports) -> DriveSection | None:
    """Gathers the drives of the benchmark; None if its config has none."""
    if plan.config.drives is None:
        return None
    made = [(planned, reports[str(planned.out)]) for planned in planned_drives(plan)]
    return drive_section([(planned, one) for planned, one in made if isinstance(one, DriveReport)], root)


def _result(planned: PlannedEvaluation, metric: Metric | None, evaluation: EvaluateReport, plan: Plan) -> Result:
    places = [(kind, *place) for kind in planned.pools for place in plan.places()]
    scenes = [
        SceneMetric(scene=scene.label, weather=weather.label, patch=kind, samples=row.samples, value=value)
        for (kind, scene, weather), row in zip(places, evaluation.rows, strict=True)
        if metric is not None and (value := metric.among(row.metrics)) is not None
    ]
    return Result(
        model=planned.model.label,
        defense=None if planned.defense is None else planned.defense.label,
        evaluation=evaluation,
        scenes=tuple(scenes),
        changes_pictures=planned.defense is not None and planned.defense.changes_pictures,
    )
