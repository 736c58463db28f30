"""`gear.evaluate`: resolves, predicts, compares, writes."""

from __future__ import annotations

import importlib.metadata
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from gear.config.dump import to_plain
from gear.dataset.files import clear_scratch, inside, write_whole
from gear.dataset.locks import alone_at_work
from gear.dataset.plan import differences
from gear.dataset.sidecar import dump_json, load_json
from gear.dataset.store import check_output
from gear.measuring.calibration import opened_calibration
from gear.measuring.dataset_run import evaluate_row
from gear.measuring.guarded_model import Player
from gear.measuring.open_datasets import opened, row_names
from gear.measuring.plugin_selection import (
    check_defense,
    chosen_defense,
    chosen_model,
)
from gear.measuring.scoring import Scorer
from gear.measuring.shown_size import size_note
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Progress
from gear.values.rng import check_seed
from gear.values.serial import Json
from gear.verbs.evaluate.compare import Measured, compared, drive_note, row_report, streets_of, together
from gear.verbs.evaluate.pools import Pools, check_pools, pooled
from gear.verbs.evaluate.report import EvaluateReport
from gear.verbs.evaluate.table import table

INTERVALS = "95 %: jackknife over streets, Student's t"
"""What results.json says of its intervals."""

LEARNT = {"calibration", "calibration_samples"}
"""What of an evaluation's plan says from what its defense learnt."""


class OtherLessonsError(DatasetError):
    """An evaluation is there that differs in what the defense learnt from, and in nothing else."""


def evaluate(
    data: str | Path | Sequence[str | Path],
    *,
    model: str,
    model_settings: Iterable[str] = (),
    defense: str | None = None,
    defense_settings: Iterable[str] = (),
    split: str | None = None,
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    reports: Sequence[str] = (),
    out: str | Path | None = None,
    batch: int | None = None,
    workers: int = 2,
    seed: int = 0,
    pools: Pools | None = None,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
) -> EvaluateReport:
    """Runs a model, with or without a defense, over datasets of its task; takes up again what was begun.

    Under `out` lie results.json, table.txt, and for each dataset a folder with the predictions in the format's own
    result layout and a note of each sample. Samples that have one are never predicted again, unless what was kept of
    them is damaged (`RowReport.damaged`). Datasets that differ in nothing but their patch are compared sample by
    sample. Intervals are of 95 %, by the jackknife over streets (`gear.measuring.intervals`).

    Args:
        data: roots of datasets, or folders of roots, all of one task; `DIR:SPLIT` says which split of one.
        model: name of a model plugin.
        model_settings: `KEY=VALUE` texts for the model's options.
        defense: name of a defense plugin.
        defense_settings: `KEY=VALUE` texts for its options.
        split: of the datasets; may be left out where each has only one.
        calibration: dataset from which the defense learns.
        calibration_patched: the same with patches.
        reports: further metrics: the task's own (`reference`); `outside_patch`, the ground truth on the patch and 5 px
            around it left out; or metric plugins, as `NAME` or `NAME:KEY=VALUE,KEY=VALUE`.
        out: folder for everything; `evaluations/<task>/<model>[+<defense>]` by default.
        batch: samples that go through the model together; one, or up to four small ones for gear's own, unless given.
        workers: threads that read, and threads that measure and write, beside the model.
        seed: of the defense's draws and of the permutation tests.
        pools: roots among the data that are counted as one dataset, by a name; those that show the same scenes as the
            pools `none` and `random` are compared with these, sample by sample.
        progress: told after every sample.
        learning: told after every calibration sample that the defense reads for the first time.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    check_seed(seed)
    if min(1 if batch is None else batch, workers) < 1:
        raise GearError(f"batch and workers must be at least 1; got {batch}, {workers}")
    chosen = chosen_model(model, model_settings)
    guard = chosen_defense(defense, defense_settings)
    datasets = opened([data] if isinstance(data, (str, Path)) else data, split, chosen, reports)
    check_pools(pools or {}, [one.root for one in datasets])
    task, names = datasets[0].plan.task["name"], row_names(datasets)
    learnt = opened_calibration(calibration, calibration_patched, [chosen], defense, on_fit_progress=on_fit_progress)
    if guard is not None:
        check_defense(guard, chosen, task, is_calibrated=learnt.clean is not None)
    usual = Path("evaluations", task, model.replace("/", "-") + f"+{defense}" * bool(defense))
    root = usual if out is None else Path(out)
    check_output(root, "write the evaluation into a folder of its own")
    player = Player(chosen, guard, calibration=learnt, seed=seed)
    facts = {
        "task": datasets[0].plan.task,
        "model": chosen.facts() | {"weights_sha256": player.weights_sha256},
        "defense": None if guard is None else guard.facts(),
        "calibration": learnt.facts(),
        **learnt.counted(),
        "seed": seed,
    }
    with alone_at_work(root):
        _begin(root, facts)
        told = _counter(on_progress, sum(len(one) for one in datasets))
        rows = []
        for dataset, name in zip(datasets, names, strict=True):
            scorer = Scorer(dataset, root, name, tuple(reports), chosen.found)
            size = batch or player.usual_batch(dataset)
            row = evaluate_row(dataset, scorer, player, batch=size, workers=workers, told=told)
            scorer.finish(row.notes)
            rows.append(
                Measured(
                    name=name,
                    dataset=dataset,
                    scorer=scorer,
                    notes=row.notes,
                    streets=streets_of(dataset),
                    made=row.made,
                    damaged=row.damaged,
                )
            )
        said = [note for one in datasets for note in (size_note(chosen, one), drive_note(one), learnt.note(one))]
        notes = [*learnt.doubts(), *(note for note in said if note)]
        plugins = {name: one.facts() for name, one in rows[0].scorer.reports.items() if one.plugin is not None}
        more = {
            "reports": list(reports),
            "metric_plugins": plugins,
            "intervals": INTERVALS,
            "versions": _versions(player),
            "notes": notes,
        }
        found = EvaluateReport(
            out=root,
            facts=facts | more,
            rows=tuple(row_report(row) for row in rows),
            together=tuple(together(rows)),
            differences=tuple(compared(rows, seed)),
            pools=tuple(pooled(rows, pools or {}, seed)),
        )
        _end(root, found)
    return found


def _begin(root: Path, facts: Json) -> None:
    """Writes what the evaluation is of, or checks that what is there is of the same, as far as a sample is."""
    clear_scratch(root)
    path = inside(root, "plan.json")
    plain = to_plain(facts)
    try:
        there = load_json(path) if path.exists() else None
    except DatasetError as error:
        problem = f"{error.problem.partition(';')[0]}; use another --out, or delete this folder"
        raise DatasetError(path, problem) from error
    is_ours = isinstance(there, dict) and there.keys() == plain.keys()
    is_empty = next(root.glob("*/samples/*.json"), None) is None
    if there is None or (is_ours and is_empty):
        write_whole(root, "plan.json", dump_json(plain))
    elif there != plain:
        what = ", ".join(differences(there, plain)[:3]) or "its plan.json has other keys"
        is_same_otherwise = is_ours and {key for key in plain if there[key] != plain[key]} <= LEARNT
        raise (OtherLessonsError if is_same_otherwise else DatasetError)(
            root, f"holds an evaluation of something else ({what}); use another --out"
        )


def _end(root: Path, found: EvaluateReport) -> None:
    """Writes what was found, and leaves nothing else behind."""
    write_whole(root, "results.json", dump_json(found.as_json()))
    write_whole(root, "table.txt", table(found).encode())
    clear_scratch(root)


def _counter(on_progress: Progress | None, total: int) -> Callable[[], None]:
    """Tells of each sample that is finished, and of the beginning."""
    finished = 0

    def told() -> None:
        nonlocal finished
        finished += 1
        if on_progress is not None:
            on_progress(finished, total)

    if on_progress is not None:
        on_progress(0, total)
    return told


def _versions(player: Player) -> Json:
    packages = {"mujoco-gear": "gear", "numpy": "numpy"}
    versions = {name: importlib.metadata.version(package) for package, name in packages.items()}
    if "torch" in sys.modules:
        versions["torch"] = str(sys.modules["torch"].__version__)
    return versions | {"python": platform.python_version(), "device": str(getattr(player.model, "device", "cpu"))}
