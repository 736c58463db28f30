"""`gear.collect`: the whole verb as one call."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.collecting.job import Job, resolve
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import open_session
from gear.collecting.workers import collect_in_processes
from gear.config.collection import CollectionConfig
from gear.config.dump import to_plain
from gear.config.load import load_collection
from gear.dataset.store import Store
from gear.plugins.build import blamed, build, find
from gear.values.counted import counted
from gear.values.progress import Progress, Warn
from gear.values.serial import Json, to_json


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectReport:
    """What a run did.

    Attributes:
        root: folder of the dataset.
        split: its name.
        samples: how many the split holds now.
        made: how many of them this run made.
    """

    root: Path
    split: str
    samples: int
    made: int

    def summary(self) -> str:
        """One line for a person."""
        kept = self.samples - self.made
        resumed = f" ({kept} were there already)" if kept else ""
        return f"{self.root}: {counted(self.samples, 'sample')} in split {self.split!r}{resumed}"


def collect(
    task: str | None = None,
    *,
    config: str | Path | None = None,
    town: str | Path | None = None,
    scene: str | None = None,
    split: str | None = None,
    samples: int | None = None,
    seed: int | None = None,
    weather: str | None = None,
    patch: str | Path | None = None,
    renderer: str | None = None,
    quality: str | None = None,
    out: str | Path | None = None,
    probes: bool | None = None,
    settings: Iterable[str] = (),
    workers: int = 1,
    apart: bool = False,
    force: bool = False,
    on_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> CollectReport:
    """Collects one dataset split; takes up again what was begun, never makes a finished sample twice.

    Args:
        task: name of a task plugin; needed unless `config` names one.
        config: name or path of a collection config; the other arguments go before what it says.
        town, scene, split, samples, seed, weather, patch, renderer, quality: as in the config.
        out: root of the dataset.
        probes: also keep what compositors need; see `gear.dataset.probe_files`.
        settings: further `KEY=VALUE` texts for any key of the config.
        workers: processes; they change nothing but time.
        apart: whether a single worker is a process of its own, too, which gives all its memory back.
        force: replaces a split that was made with another configuration.
        progress: told after every sample.
        noted: called, before anything is rendered, with each note on what the user may not have meant: patches of
            another scene, options of the task.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    given = {
        "task": task,
        "town": town,
        "scene": scene,
        "split": split,
        "samples": samples,
        "seed": seed,
        "weather": weather,
        "patch": patch,
        "renderer": renderer,
        "quality": quality,
        "root": out,
        "probes": None if probes is None else str(probes).lower(),
    }
    flags = {key: None if value is None else str(value) for key, value in given.items()}
    return collect_config(
        load_collection(None if config is None else str(config), flags, settings),
        workers=workers,
        apart=apart,
        force=force,
        on_progress=on_progress,
        on_warning=on_warning,
    )


def collect_config(
    config: CollectionConfig,
    *,
    workers: int = 1,
    apart: bool = False,
    force: bool = False,
    on_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> CollectReport:
    """As `collect`, from a config object."""
    if workers < 1:
        raise ValueError(f"workers must be at least 1, got {workers}")
    job = resolve(config)
    if on_warning is not None:
        for note in job.notes:
            on_warning(note)
    return run_job(job, workers=workers, apart=apart, force=force, on_progress=on_progress)


def run_job(
    job: Job, *, workers: int = 1, apart: bool = False, force: bool = False, on_progress: Progress | None = None
) -> CollectReport:
    """Collects what is missing of a resolved job and closes the split."""
    store = Store(job.root, job.plan)
    plugin = find("task", job.config.task)
    with store.begun(job.patch.files, force=force):
        made = _collect_missing(job, store, workers, apart, on_progress)
        task = build(plugin, job.config.options)
        with blamed(plugin, "finalise"):
            store.close(task, manifest_facts(job))
    return CollectReport(root=job.root, split=job.plan.info.split, samples=job.plan.samples, made=made)


def _collect_missing(job: Job, store: Store, workers: int, apart: bool, on_progress: Progress | None) -> int:
    """How many samples it made."""
    missing = store.missing()
    finished = job.plan.samples - len(missing)

    def done(_: int) -> None:
        nonlocal finished
        finished += 1
        if on_progress is not None:
            on_progress(finished, job.plan.samples)

    if on_progress is not None:
        on_progress(finished, job.plan.samples)
    if missing and workers == 1 and not apart:
        with open_session(job) as session:
            collect_samples(session, store, missing, done)
    elif missing:
        collect_in_processes(job, missing, workers, done)
    return len(missing)


def manifest_facts(job: Job) -> dict[str, Json]:
    """What the manifest says beside hashes: nothing in it depends on the machine's paths, the clock or the workers."""
    config: dict[str, Any] = to_plain(job.config)
    for name in ("root", "patch", "town", "scenes", "simulation", *(() if job.config.probes else ("probes",))):
        config.pop(name)
    return {
        "task": dict(job.plan.task),
        "options": job.plan.options,
        "info": to_json(job.plan.info),
        "seed": job.split.seed,
        "patch": dict(job.plan.patch),
        "renderer": to_json(job.renderer),
        "versions": job.plan.content["versions"],
        "scene": job.plan.content["scene"],
        "weather": to_json(job.weather),
        "assets": job.plan.content["assets"],
        "config": config,
    }
