"""Runs one collection job: makes the missing samples and writes the split's manifest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from gear.collecting.job import Job
from gear.collecting.missing import collect_missing
from gear.contracts.executors import Executor
from gear.dataset.checks.existing_samples import refuse_damaged
from gear.dataset.executors.engines import DEFAULT, open_engine, open_executor
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.locks import SHARED, lock_note
from gear.dataset.plan import manifest_facts
from gear.dataset.sharding.shards import WHOLE, Shard
from gear.dataset.store import Store
from gear.plugins.build import blamed, build, find
from gear.values.counted import counted
from gear.values.progress import Callbacks

CHECKING, CLOSING = "checking existing samples", "writing indexes and manifest"
"""Titles of the parts of a collection before and after the samples are made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectReport:
    """The result of a collection.

    Attributes:
        root: folder of the dataset.
        split: name of the split.
        samples: number of samples in the split, or in the collected shard.
        made: number of samples that this run made.
        shard: the collected part of the split as `I/N`; None for the whole split.
    """

    root: Path
    split: str
    samples: int
    made: int
    shard: str | None = None

    def summary(self) -> str:
        """The dataset's folder and the number of samples, as one line of text."""
        kept = self.samples - self.made
        resumed = f" ({kept} were there already)" if kept else ""
        if self.shard is None:
            return f"{self.root}: {counted(self.samples, 'sample')} in split {self.split!r}{resumed}"
        return (
            f"{self.root}: {counted(self.samples, 'sample')} of shard {self.shard} of split {self.split!r}{resumed}; "
            "after the last shard run the same command without --shard, or `gear merge` for separate folders"
        )


def executor_of(
    job: Job, workers: int, *, engine: str = DEFAULT, address: str | None = None, in_subprocess: bool = False
) -> Executor:
    """The executor that makes the samples of a job with a given engine.

    A single worker of the default engine is this process itself, unless `in_subprocess` is set.

    Args:
        job: the collection job.
        workers: number of workers.
        engine: name of the engine, such as `processes`, `ray` or `slurm`.
        address: address of the engine's cluster; None for the default.
        in_subprocess: whether a single worker is another process, so a crash of the renderer does not end this one.

    Raises:
        UnknownNameError: there is no such engine.
        GearError: the engine cannot use the address, or a package that it needs is not installed.
    """
    opened = open_engine if in_subprocess else open_executor
    return opened(engine, workers=workers, backend=job.config.renderer, address=address)


def run_job(
    job: Job,
    *,
    executor: Executor | None = None,
    force: bool = False,
    shard: Shard | None = None,
    callbacks: Callbacks | None = None,
) -> CollectReport:
    """Makes the missing samples of a job and, if the whole split is collected, writes its index files and
    manifest.

    Args:
        job: the collection job.
        executor: executor that makes the samples; this process by default.
        force: whether a split made with another configuration is replaced.
        shard: the part of the split to collect; None for all of it. The manifest is not written for a part.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        SamplesFailedError: some samples could not be made; all other samples are kept.
        GearError: no sample can be made, or a file cannot be written.
    """
    store = Store(job.root, job.plan)
    plugin = find("task", job.config.task)
    part = shard or WHOLE
    callbacks = callbacks or Callbacks()
    with store.begun(job.patch.files, force=force):
        if (note := lock_note(job.root, SHARED)) is not None:
            callbacks.on_warning(note)
        refuse_damaged(store, part, callbacks.part(CHECKING))
        absolute = replace(job, root=job.root.absolute())  # workers of other machines have other current folders
        made = collect_missing(absolute, store, part, executor or InThisProcess(), callbacks)
        if shard is None:
            task = build(plugin, job.config.options)
            with blamed(plugin, "finalise"):
                store.close(task, manifest_facts(job.plan), callbacks.part(CLOSING))
    return CollectReport(
        root=job.root,
        split=job.plan.info.split,
        samples=len(store.indices(part)),
        made=made,
        shard=None if shard is None else str(shard),
    )
