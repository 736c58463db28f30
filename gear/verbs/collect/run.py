"""`gear.collect`: renders one split of a dataset with its ground truth."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gear.collecting.job import resolve
from gear.collecting.run import CollectReport, executor_of, run_job
from gear.collecting.workers import Workers, fitting_workers
from gear.dataset.executors.engines import DEFAULT
from gear.reporting.display import displayed
from gear.values.progress import Callbacks, Progress, Warn
from gear.verbs.collect.request import CollectRequest


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
    engine: str = DEFAULT,
    address: str | None = None,
    workers: Workers = 1,
    shard: str | None = None,
    in_subprocess: bool = False,
    force: bool = False,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> CollectReport:
    """Collects one dataset split; resumes an interrupted collection and never makes a finished sample twice.

    Args:
        task: name of a task plugin; required unless `config` names one.
        config: name or path of a collection config; the other arguments override its values.
        town, scene, split, samples, seed, weather, patch, renderer, quality: values of the config keys with these names
            (`gear show-config` prints all keys).
        out: root of the dataset.
        probes: whether probes are also written: each sample rendered with the surfaces black and white, from which a
            compositor can put any patch into the picture.
        settings: further `KEY=VALUE` texts for any key of the config.
        engine: name of the engine that makes the samples; `processes` uses processes on this machine.
        address: address of the engine's cluster: a Ray cluster, or a partition of SLURM.
        workers: number of workers of the engine, or `auto`: as many as cores and memory of this machine allow. The
            result does not depend on this number.
        shard: `I/N`, to collect the I-th of N parts of the split. Sequences stay whole. Shards may be collected in any
            order, at any time and on any machine. A run without a shard makes what is missing and closes the split;
            `gear.merge` joins shards of separate folders.
        in_subprocess: whether a single worker also runs in a separate process, whose memory is freed at the end.
        force: whether an existing split with another configuration is replaced.
        progress: shows a progress bar.
        on_progress: called after every sample.
        on_warning: called before rendering with lines on settings that may be unintended, such as patches of another
            scene.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = CollectRequest(
        task=task,
        config=config,
        town=town,
        scene=scene,
        split=split,
        samples=samples,
        seed=seed,
        weather=weather,
        patch=patch,
        renderer=renderer,
        quality=quality,
        out=out,
        probes=probes,
        settings=tuple(settings),
        engine=engine,
        address=address,
        workers=workers,
        shard=shard,
        in_subprocess=in_subprocess,
        force=force,
    )
    callbacks = Callbacks.of(on_progress=on_progress, on_warning=on_warning)
    with displayed(callbacks, "collect", progress=progress) as shown:
        return run_collect(request, shown)


def run_collect(request: CollectRequest, callbacks: Callbacks) -> CollectReport:
    """Collects a split with the arguments in `request`, which `gear.collect` describes.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    job = resolve(request.loaded())
    for note in job.notes:
        callbacks.on_warning(note)
    executor = executor_of(
        job,
        fitting_workers(request.workers),
        engine=request.engine,
        address=request.address,
        in_subprocess=request.in_subprocess,
    )
    shard = request.chosen_shard()
    return run_job(job, executor=executor, force=request.force, shard=shard, callbacks=callbacks)
