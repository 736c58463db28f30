"""Runs one collection job from its missing samples to the closed split."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gear.collecting.forecast import Forecast
from gear.collecting.job import Job
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import open_session
from gear.dataset.executors.engines import DEFAULT, open_engine
from gear.dataset.executors.executor import Done, Executor, InThisProcess
from gear.dataset.store import Store
from gear.plugins.build import blamed, build, find
from gear.values.counted import counted
from gear.values.progress import Callbacks
from gear.values.serial import Json, to_json


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectReport:
    """The result of a collection.

    Attributes:
        root: folder of the dataset.
        split: name of the split.
        samples: number of samples in the split.
        made: number of samples made by this run.
    """

    root: Path
    split: str
    samples: int
    made: int

    def summary(self) -> str:
        """The result in one line."""
        kept = self.samples - self.made
        resumed = f" ({kept} were there already)" if kept else ""
        return f"{self.root}: {counted(self.samples, 'sample')} in split {self.split!r}{resumed}"


def executor_of(job: Job, workers: int, *, engine: str = DEFAULT, in_subprocess: bool = False) -> Executor:
    """The executor of an engine; a single worker of the default engine is this process, unless a process of its own is
    requested.

    Raises:
        UnknownNameError: there is no such engine.
    """
    if workers == 1 and engine == DEFAULT and not in_subprocess:
        return InThisProcess()
    return open_engine(engine, workers=workers, backend=job.config.renderer)


def run_job(
    job: Job, *, executor: Executor | None = None, force: bool = False, callbacks: Callbacks | None = None
) -> CollectReport:
    """Collects the missing samples of a resolved job and closes the split.

    Args:
        job: the job.
        executor: executor that makes the samples; this process by default.
        force: whether a split made with another configuration is replaced.
        callbacks: callbacks that receive the progress.

    Raises:
        GearError: a sample cannot be made or written.
    """
    store = Store(job.root, job.plan)
    plugin = find("task", job.config.task)
    with store.begun(job.patch.files, force=force):
        store.refuse_damaged()
        made = _collect_missing(job, store, executor or InThisProcess(), callbacks or Callbacks())
        task = build(plugin, job.config.options)
        with blamed(plugin, "finalise"):
            store.close(task, manifest_facts(job))
    return CollectReport(root=job.root, split=job.plan.info.split, samples=job.plan.samples, made=made)


def _collect_missing(job: Job, store: Store, executor: Executor, callbacks: Callbacks) -> int:
    """Makes the missing samples; returns their number."""
    missing = store.missing()
    finished = job.plan.samples - len(missing)

    forecast = Forecast(store, len(missing), callbacks.on_warning)

    def done(index: int) -> None:
        nonlocal finished
        finished += 1
        callbacks.on_progress(finished, job.plan.samples)
        forecast.sample_done(index)

    callbacks.on_progress(finished, job.plan.samples)
    executor.run(partial(_make_samples, job), missing, done)
    return len(missing)


def _make_samples(job: Job, indices: Iterator[int], done: Done) -> None:
    """The work of one worker: a world and a renderer, opened once for all of its samples."""
    with open_session(job) as session:
        collect_samples(session, Store(job.root, job.plan), indices, done)


def manifest_facts(job: Job) -> dict[str, Json]:
    """The facts of the manifest beside hashes; none depends on paths of the machine, the clock or the workers."""
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
        "config": job.plan.recipe,
    }
