"""`gear.merge`: joins the shards of a collection, which lie in separate folders, into one dataset."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

from gear.collecting.patch_sources import digest_of, read_patch
from gear.contracts.tasks import NO_PATCH
from gear.dataset.free_space import check_free_space, tree_bytes
from gear.dataset.plan import manifest_facts, refuse_other_tasks
from gear.dataset.remote.folder import RemoteFolder, is_address, local_path
from gear.dataset.remote.merge import begin_remote_merge, copy_samples_to, finish_remote_merge
from gear.dataset.sealed_json import REPAIR, DamagedError
from gear.dataset.sharding.merging import Parts, copy_patches, copy_samples, estimated_bytes, find_parts, prepare_merge
from gear.dataset.store import Store, splits_of
from gear.dataset.whole_tree import check_target, whole_tree
from gear.plugins.build import blamed, find, name_of_task
from gear.plugins.datasets import task_of
from gear.reporting.display import displayed
from gear.values.counted import counted
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks, Progress

CLOSING = "writing indexes and manifest"
"""Title of the part of a merge after the samples are copied."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MergeReport:
    """The result of `gear.merge`.

    Attributes:
        root: folder of the new dataset, or its address.
        samples: number of samples of each split, by name of the split.
        sources: number of folders that were joined.
    """

    root: Path | str
    samples: Mapping[str, int]
    sources: int

    def summary(self) -> str:
        """Returns the result as one line of text."""
        splits = ", ".join(f"{counted(count, 'sample')} in split {name!r}" for name, count in self.samples.items())
        return f"{self.root}: {splits} from {counted(self.sources, 'folder')}"


def merge(
    datasets: Iterable[str | Path],
    *,
    out: str | Path,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> MergeReport:
    """Joins folders with shards (parts) of the same collection into one dataset, and completes its splits.

    The result has the same bytes as a dataset collected in one run. It is written into a hidden folder next to `out`,
    which is renamed when it is complete. After an interrupted merge, the same command continues. The source folders are
    not changed.

    Args:
        datasets: roots of the source folders, each with some samples of one or several splits.
        out: folder of the new dataset; must be empty or new. An address of fsspec, such as `s3://bucket/folder`, is
            filled directly: the manifests are written last, and a split without a manifest is not finished.
        progress: shows a progress bar.
        on_progress: called after every sample with (finished samples, samples of the split).

    Raises:
        GearError: no folder was given, or the disk is too small.
        DatasetError: the folders were made with different configurations; a sample is in none of them; a file is
            damaged or a path leads outside its folder, `out` is not empty, or a file cannot be written.
        UnknownNameError: the plugin of the task is not installed.
    """
    roots = [Path(root) for root in datasets]
    if not roots:
        raise GearError("merge: no folder was given; name the folders with the shards")
    with displayed(Callbacks.of(on_progress=on_progress), "merge", progress=progress) as callbacks:
        return _merged(roots, out, callbacks)


def _merged(roots: Sequence[Path], out: str | Path, callbacks: Callbacks) -> MergeReport:
    """Merges folders into a folder or into an address."""
    listed = callbacks.part("listing the samples of all folders")
    splits = sorted({split for root in roots for split in splits_of(root)})
    parts = [find_parts(roots, split, listed) for split in splits]
    for one in parts:
        _check_versions(one)
        for root in roots:
            refuse_other_tasks(root, one.plan)
    report = MergeReport(
        root=out if isinstance(out, str) and is_address(out) else local_path(out),
        samples={one.split: one.plan.samples for one in parts},
        sources=len(roots),
    )
    if isinstance(report.root, str):
        _merge_to(RemoteFolder(report.root), parts, callbacks)
        return report
    target = report.root.resolve()
    check_target(target, "merge")
    for root in roots:
        if target.is_relative_to(root.resolve()):
            raise DatasetError(target, f"lies in {root}, which is merged; use another --out")
    with whole_tree(target, "merge", is_kept=True) as unfinished:
        prepare_merge(unfinished, [one.plan for one in parts])
        needed = sum(map(estimated_bytes, parts)) - tree_bytes(unfinished)
        check_free_space(target, needed, what="the merged samples need", advice="give --out on another disk")
        for one in parts:
            if one.plan.patch["label"] != NO_PATCH:
                copy_patches(one, unfinished, partial(_check_patch, one))
            copy_samples(one, unfinished, callbacks.on_progress)
            _close(one, unfinished, callbacks.part(CLOSING))
    return report


def _merge_to(folder: RemoteFolder, parts: Sequence[Parts], callbacks: Callbacks) -> None:
    """Merges into a folder at an address."""
    with tempfile.TemporaryDirectory(prefix="gear-merge-") as name:
        staging = Path(name)
        plans = [one.plan for one in parts]
        prepare_merge(staging, plans)
        begin_remote_merge(folder, staging, plans)
        for one in parts:
            if one.plan.patch["label"] != NO_PATCH:
                copy_patches(one, staging, partial(_check_patch, one))
            copy_samples_to(one, folder, staging, callbacks.on_progress)
            _close(one, staging, callbacks.part(CLOSING))
        finish_remote_merge(folder, staging, [one.split for one in parts])


def _close(parts: Parts, root: Path, on_progress: Progress) -> None:
    """Writes the index files and the manifest of a split whose sidecars are all in `root`."""
    with blamed(find("task", name_of_task(parts.plan.task)), "finalise"):
        task = task_of(parts.roots[0], parts.plan)
        Store(root, parts.plan).close(task, manifest_facts(parts.plan), on_progress)


def _check_versions(parts: Parts) -> None:
    """Checks that the samples were made by the installed versions of gear and of the task; other versions could
    write other index files.

    Raises:
        DatasetError: the versions differ; the message names both.
        UnknownNameError: the plugin of the task is not installed.
    """
    owner = find("task", name_of_task(parts.plan.task)).owner
    made_by = parts.plan.task.get("package", "?"), parts.plan.task.get("version", "?")
    if made_by != (owner.package, owner.version):
        raise _other_version(parts, *made_by, f"{owner.package} {owner.version}")
    versions = parts.plan.content.get("versions") if isinstance(parts.plan.content, dict) else None
    made = versions.get("gear", "?") if isinstance(versions, dict) else "?"
    if made not in (installed := version("mujoco-gear"), "source"):
        raise _other_version(parts, "mujoco-gear", str(made), f"mujoco-gear {installed}")


def _other_version(parts: Parts, package: str, made_by: str, installed: str) -> DatasetError:
    problem = f"split {parts.split!r} was made by {package} {made_by}, this is {installed}"
    return DatasetError(parts.roots[0], f"{problem}; merge it with the version that made it")


def _check_patch(parts: Parts, pictures: Mapping[str, Path]) -> None:
    """Checks that the patch pictures in the folders are those that were collected.

    Raises:
        DamagedError: the pictures or their number differ.
        PatchError: a picture cannot be read.
    """
    ordered = [path for _, path in sorted(pictures.items(), key=lambda item: (len(item[0]), item[0]))]
    if digest_of(read_patch(path) for path in ordered) != parts.plan.patch["sha256"]:
        raise DamagedError(ordered[0].parent, f"are not the pictures of the patch that was collected; {REPAIR}")
