"""Writes a split: finds the missing samples, writes the files of samples, and finishes the split with its manifest."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.contracts.tasks import Auxiliary, Encoded, ExtendsIndexes, Sample, Sidecar, Task
from gear.dataset.claims import clear_claims
from gear.dataset.failures import clear_failures
from gear.dataset.files import clear_scratch, inside, read_bytes, sha256, sync_folder, write_whole
from gear.dataset.find_datasets import no_dataset
from gear.dataset.finishing.cards import write_cards
from gear.dataset.finishing.closing import ClosedPart, SidecarStream, can_extend, closed_part
from gear.dataset.guarded_paths import owned, refuse_links, remove_empty_folders, remove_file, remove_files
from gear.dataset.json_text import dump_json, load_json
from gear.dataset.layout import (
    GEAR,
    begun_path,
    claim_path,
    failed_path,
    is_reserved,
    manifest_path,
    patch_path,
    plan_path,
    sidecar_path,
    split_folder,
)
from gear.dataset.locks import dataset_lock, is_locked, shared_split_lock
from gear.dataset.plan import Plan, begin, read_plan, refuse_copy, refuse_other_tasks
from gear.dataset.sealed_json import REPAIR, DamagedError, load_sealed, sealed_json
from gear.dataset.sharding.shards import WHOLE, Shard
from gear.dataset.sidecar import no_sidecar, read_sidecar, sidecar_bytes
from gear.values.errors import DatasetError, FieldError, ReplaceableError, SamplesFailedError
from gear.values.progress import NO_CALLBACKS, Progress
from gear.values.serial import Json


def check_output(root: Path, instead: str) -> None:
    """Checks that a folder for results is not a dataset and contains no link, before a command writes into it.

    Args:
        root: the folder; it may be missing.
        instead: advice for the message if the folder is a dataset.

    Raises:
        DatasetError: the folder is a dataset, or there is a link in it.
    """
    if any(root.glob(f"{GEAR}/*/plan.json")):
        raise DatasetError(root, f"is a dataset; {instead}")
    refuse_links(root)


@dataclass(frozen=True, slots=True)
class Store:
    """A split that is being collected: its files on disk and its plan.

    Attributes:
        root: folder of the dataset.
        plan: everything that decides the bytes of the split.
    """

    root: Path
    plan: Plan

    @property
    def split(self) -> str:
        """The name of the split."""
        return self.plan.info.split

    def open(self, patch_files: Mapping[str, bytes]) -> None:
        """Starts the split or continues it. A split without any sample is started anew.

        Args:
            patch_files: pictures of the patch to copy into the dataset, bytes by name.

        Raises:
            DatasetError: a file cannot be written, the split was made with another configuration, a sidecar was changed
                since the split was finished, or the dataset contains a link.
        """
        refuse_links(self.root)
        clear_scratch(self.root)
        _forget_empty(self.root, self.plan)
        self._refuse_changed()
        begin(self.root, self.plan)
        for name, data in patch_files.items():
            self._keep_patch(patch_path(self.plan.info.patch_label, name), data)

    def _refuse_changed(self) -> None:
        """Refuses sidecars that were changed, because the manifest that is written at the end would hold
        their hashes.
        """
        try:
            there = load_sealed(inside(self.root, manifest_path(self.split)))
        except DatasetError:  # missing, or damaged and written anew when the split is closed
            return
        hashes = there.get("sidecars") if isinstance(there, dict) else None
        for relative, digest in hashes.items() if isinstance(hashes, dict) else ():
            path = inside(self.root, relative)
            if path.exists() and sha256(read_bytes(path)) != digest:
                read_sidecar(path)  # says more of what cannot be true
                raise DamagedError(path, f"is not what the manifest says that was collected; {REPAIR}")

    def _keep_patch(self, relative: str, data: bytes) -> None:
        """Copies a picture of the patch into the dataset; refuses it if another split shows a different patch of that
        name.
        """
        self._refuse_other_patch(relative, data)
        target = inside(self.root, relative)
        if not (target.exists() and target.read_bytes() == data):
            write_whole(self.root, relative, data)

    def _refuse_other_patch(self, relative: str, data: bytes) -> None:
        target = inside(self.root, relative)
        if not target.exists() or target.read_bytes() == data:
            return
        label, digest = self.plan.patch["label"], self.plan.patch["sha256"]
        others = {path.parent.name for path in (self.root / GEAR).glob("*/plan.json")} - {self.split}
        for split in sorted(others):
            other = plan_of(self.root, split).patch
            if other["label"] == label and other.get("sha256") != digest:
                problem = f"split {split!r} shows other patches of the name {label!r}; use another --out"
                raise DatasetError(self.root, problem)

    def _replace(self, patch_files: Mapping[str, bytes]) -> None:
        """Removes the split, after all checks that could refuse the new one."""
        _forget_empty(self.root, self.plan, besides=self.split)
        refuse_other_tasks(self.root, self.plan, besides=self.split)
        for name, data in patch_files.items():
            self._refuse_other_patch(patch_path(self.plan.info.patch_label, name), data)
        _remove_idle(self.root, self.split)

    @contextlib.contextmanager
    def begun(self, patch_files: Mapping[str, bytes], *, force: bool = False) -> Iterator[None]:
        """A context in which a run writes samples of the split; it opens the split and locks its folder.

        If a new split fails before its first sample, the split is removed, so it does not block the next run with
        another configuration. The notes on failed samples are kept.

        Args:
            patch_files: pictures of the patch to copy into the dataset, bytes by name.
            force: whether an existing split is removed first.

        Raises:
            DatasetError: a file cannot be written, the split was made with another configuration or was changed, or
                another run is writing the split that would have to be removed.
        """
        refuse_links(self.root)
        was_there = {folder for folder in self._folders() if folder.exists()}
        is_new = not self._is_begun()
        with contextlib.ExitStack() as work:
            try:
                with dataset_lock(self.root):
                    if force:
                        self._replace(patch_files)
                    is_new = not self._is_begun()  # others may have begun it, or taken it back, while this one waited
                    self.open(patch_files)
                    work.enter_context(shared_split_lock(inside(self.root, split_folder(self.split))))
                yield
            except BaseException as error:
                work.close()
                if not isinstance(error, SamplesFailedError) and is_new and len(self.missing()) == self.plan.samples:
                    self._take_back(was_there)
                raise

    def _is_begun(self) -> bool:
        return inside(self.root, plan_path(self.split)).exists()

    def _folders(self) -> Sequence[Path]:
        return [self.root, *self.root.parents]

    def _take_back(self, was_there: Set[Path]) -> None:
        """Removes the split and all folders that become empty, except those that existed before."""
        with contextlib.suppress(OSError, DatasetError):
            if self.root.is_dir():
                with dataset_lock(self.root):
                    _remove_idle(self.root, self.split)
            remove_empty_folders(self.root, GEAR)
            for folder in self._folders():
                if folder not in was_there:
                    with contextlib.suppress(FileNotFoundError):
                        folder.rmdir()

    def indices(self, shard: Shard = WHOLE) -> list[int]:
        """The indices of a shard's samples, in order; all frames of a driving sequence are in the same shard."""
        frames = self.plan.frames_per_sequence
        return [index for index in range(self.plan.samples) if shard.holds(index // frames)]

    def missing(self, shard: Shard = WHOLE) -> list[int]:
        """The indices of a shard's samples that have no sidecar (JSON file of a sample); a sample with a sidecar
        is complete.
        """
        folder = inside(self.root, split_folder(self.split)) / "samples"
        there = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        return [index for index in self.indices(shard) if f"{index:06d}.json" not in there]

    def write(
        self,
        sample: Sample,
        encoded: Encoded,
        auxiliary: Mapping[str, tuple[Auxiliary, bytes]] | None = None,
        *,
        device: Mapping[str, str] | None = None,
    ) -> None:
        """Writes the files of one sample, and last its sidecar (JSON file), which marks the sample as complete.

        Args:
            sample: the sample with its scene record and surfaces.
            encoded: the files and metadata that the task made from the sample.
            auxiliary: additional files of the sample, such as probes, with their bytes, by name.
            device: device that rendered the sample, for splits with mixed devices.

        Raises:
            DatasetError: a file cannot be written.
        """
        further = auxiliary or {}
        hashes: dict[str, str] = {}
        files = sorted([*encoded.files.items(), *((file.path, data) for file, data in further.values())])
        begun = begun_path(self.split, f"{sample.record.index:06d}")
        write_whole(self.root, begun, dump_json([relative for relative, _ in files]))
        for relative, data in files:
            write_whole(self.root, relative, data)
            hashes[relative] = sha256(data)
        sidecar = Sidecar(
            record=sample.record,
            surfaces=sample.surfaces,
            facts=encoded.facts,
            files=hashes,
            auxiliary={name: file for name, (file, _) in further.items()},
            device=device or {},
        )
        write_whole(self.root, sidecar_path(self.split, sample.record.index), sidecar_bytes(sidecar))
        remove_file(self.root, begun)

    def _patches(self) -> dict[str, Json]:
        """The manifest's entry for the copies of the patches; empty if the split shows no patch."""
        folder = inside(self.root, patch_path(self.plan.patch["label"], "patch_0.png")).parent
        paths = [path for path in sorted(folder.glob("patch_*.png")) if path.is_file()]
        return {"patches": {_relative(self.root, path): sha256(read_bytes(path)) for path in paths}} if paths else {}

    def close(
        self, task: Task[Any, Any], facts: Mapping[str, Json], on_progress: Progress = NO_CALLBACKS.on_progress
    ) -> None:
        """Writes the index files of the format, the manifest and the dataset card, in this order.

        Nothing is written if another run has meanwhile started to extend the split; that run writes these files.

        Args:
            task: the task, which makes the index files.
            facts: metadata for the manifest, such as versions, renderer and configuration.
            on_progress: called after every sample whose sidecar was read for the first time.

        Raises:
            DatasetError: a file cannot be written, or a sample is missing.
        """
        there = read_plan(self.root, self.split)
        if there is not None and there.samples > self.plan.samples:
            return
        views = {camera.name for camera in task.rig().cameras}
        keys = {"twin_key": self.plan.twin_key, "content_key": self.plan.content_key}
        closed = closed_part(self.root, self.split, self.plan.samples, {**keys, **facts})
        sidecars = SidecarStream(self.root, self.split, self.plan.samples, views, closed, on_progress)
        indexes: dict[str, str] = {}
        files = sorted(self._indexes(task, sidecars, closed).items())
        begun = begun_path(self.split, "indexes")
        if not inside(self.root, manifest_path(self.split)).exists():
            write_whole(self.root, begun, dump_json([relative for relative, _ in files]))
        for relative, data in files:
            target = inside(self.root, relative)
            if not (target.exists() and target.read_bytes() == data):
                write_whole(self.root, relative, data)
            indexes[relative] = sha256(data)
        listed = sidecars.facts()
        manifest = {
            "format": "gear-dataset",
            "version": 1,
            **keys,
            **facts,
            "samples": listed["samples"],
            "indexes": indexes,
            "sidecars": listed["sidecars"],
            **self._patches(),
        }
        data = sealed_json(manifest)
        target = inside(self.root, manifest_path(self.split))
        if not (target.exists() and target.read_bytes() == data):
            write_whole(self.root, manifest_path(self.split), data)
        notes = owned(self.root, begun).parent
        remove_files(self.root, [_relative(self.root, left) for left in notes.glob("*.json")])
        remove_empty_folders(self.root, _relative(self.root, notes))
        clear_claims(self.root, self.split)
        clear_failures(self.root, self.split)
        write_cards(self.root)
        clear_scratch(self.root)
        sync_folder(target.parent)

    def _indexes(
        self, task: Task[Any, Any], sidecars: Sequence[Sidecar], closed: ClosedPart | None
    ) -> Mapping[str, bytes]:
        """The index files of the format, by path. A task that can extend them reads only the sidecars of new samples.

        Raises:
            DatasetError: a sidecar lacks something that the task needs.
        """
        try:
            if closed is not None and isinstance(task, ExtendsIndexes) and can_extend(type(task)):
                return task.extend(closed.indexes, len(closed.entries), sidecars, self.plan.info)
            return task.finalise(sidecars, self.plan.info)
        except FieldError:  # facts are the task's own, which reads them with `from_json`
            for sidecar in sidecars:
                try:
                    task.finalise([sidecar], self.plan.info)
                except FieldError as error:
                    problem = FieldError(f"facts.{error.field}", error.problem)
                    raise self._no_sidecar(sidecar, problem) from error
            raise

    def _no_sidecar(self, sidecar: Sidecar, error: FieldError) -> DatasetError:
        return no_sidecar(self.root / sidecar_path(self.split, sidecar.record.index), error)


def _forget_empty(root: Path, plan: Plan, *, besides: str = "") -> None:
    """Removes splits without samples that conflict with a plan."""
    for path in sorted((root / GEAR).glob("*/plan.json")):
        split = path.parent.name
        if (
            split == besides
            or any(inside(root, f"{split_folder(split)}/samples").glob("*.json"))
            or (path.parent / "manifest.json").exists()
        ):
            continue
        there = read_plan(root, split)
        is_same_task = there is not None and there.task["name"] == plan.task["name"]
        is_part = there is not None and there.content_key == plan.content_key and there.samples <= plan.samples
        if not is_same_task or (split == plan.info.split and not is_part):
            _remove_idle(root, split)


def _remove_idle(root: Path, split: str) -> None:
    """`remove_split`, unless a run is writing the split.

    Raises:
        DatasetError: a run is writing it, or as `remove_split`.
    """
    if is_locked(inside(root, split_folder(split))):
        problem = f"another run is making split {split!r} just now; wait for its end, or use another --out"
        raise DatasetError(root, problem)
    remove_split(root, split)


def remove_split(root: Path, split: str) -> None:
    """Deletes the files that gear wrote for a split, and no other files; the dataset card is written anew.

    These files are named by the sidecars, the manifest and the lists of unfinished files. The copy of the patch is also
    deleted, if no other split shows it.

    All paths are checked before the first file is deleted. A sample's sidecar is deleted before its files, so a sample
    without its files never counts as complete if the deletion is interrupted. If a sidecar is missing or damaged, the
    files of its sample are taken from the manifest.

    Args:
        root: folder of the dataset.
        split: name of the split.

    Raises:
        DatasetError: a file cannot be deleted, or its path leaves the root or leads through a link; or the split's
            folder is a copy of another split, whose files it names.
    """
    folder = owned(root, split_folder(split))
    if not folder.is_dir():
        return
    refuse_copy(root, split)
    samples = sorted(owned(root, f"{split_folder(split)}/samples").glob("*.json"))
    notes = sorted(owned(root, begun_path(split, "x")).parent.glob("*.json"))
    claims = sorted(owned(root, claim_path(split, 0)).parent.glob("*.claim"))
    manifest = folder / "manifest.json"
    listed = _load_if_json(manifest)
    doomed = [_relative(root, manifest), *_files_named(listed, split)]
    for path in samples:
        doomed += [_relative(root, path), *_files_named(_load_if_json(path), split)]
    doomed += _files_of_samples(listed, split)
    for path in notes:
        doomed += [*_files_named(_load_if_json(path), split), _relative(root, path)]
    doomed += [_relative(root, path) for path in owned(root, failed_path(split, 0)).parent.glob("*.json")]
    label = _patch_label(root, split)
    copies = owned(root, patch_path(label or "none", "patch_0.png")).parent
    doomed += [_relative(root, path) for path in claims]
    remove_files(root, [*doomed, plan_path(split)])
    remove_empty_folders(root, split_folder(split))
    others = {_patch_label(root, path.parent.name) for path in (root / GEAR).glob("*/plan.json")}
    if label and label not in others:
        remove_files(root, [_relative(root, path) for path in copies.glob("patch_*.png")])
        remove_empty_folders(root, _relative(root, copies))
    write_cards(root)


def _relative(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()


def _files_named(there: Json, split: str) -> list[str]:
    """The files that a sidecar, a manifest or a note of unfinished files names, without files that gear never names
    there; none if it is damaged.
    """
    named = there if isinstance(there, list) else _names(there, "files") + _names(there, "indexes")
    return [name for name in named if isinstance(name, str) and not is_reserved(name, split)]


def _files_of_samples(there: Json, split: str) -> list[str]:
    """The files of samples that a manifest lists; none if it is damaged."""
    samples = there.get("samples") if isinstance(there, dict) else None
    return [name for one in (samples if isinstance(samples, list) else ()) for name in _files_named(one, split)]


def _load_if_json(path: Path) -> Json:
    """The content of a JSON file; None if it is missing or not JSON."""
    try:
        return load_json(path)
    except DatasetError:
        return None


def _names(value: Json, key: str) -> list[str]:
    """The keys of an object that is an entry of another one."""
    inner = value.get(key) if isinstance(value, dict) else None
    return list(inner) if isinstance(inner, dict) else []


def _patch_label(root: Path, split: str) -> str:
    """The label of a split's patch; empty if its plan is damaged."""
    try:
        plan = read_plan(root, split)
    except DatasetError:
        return ""
    return "" if plan is None else plan.patch["label"]


def splits_of(root: Path) -> Sequence[str]:
    """The names of a dataset's splits, finished or not, sorted.

    Args:
        root: folder of the dataset.

    Raises:
        DatasetError: the folder is not a dataset.
    """
    folder = root / "gear"
    names = sorted(p.parent.name for p in folder.glob("*/plan.json")) if folder.is_dir() else []
    if not names:
        raise no_dataset(root)
    return names


def plan_of(root: Path, split: str) -> Plan:
    """Reads the plan of a split (everything that decides its bytes); the split must exist.

    Args:
        root: folder of the dataset.
        split: name of the split.

    Raises:
        DatasetError: there is no such split, or its plan cannot be read.
    """
    try:
        plan = read_plan(root, split)
    except ReplaceableError as error:  # whose remedies are those of a collection
        raise DatasetError(root, f"{error.problem}; collect the split again") from error
    if plan is None:
        raise DatasetError(root, f"has no split {split!r}; there are: {', '.join(splits_of(root))}")
    return plan
