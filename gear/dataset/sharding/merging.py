"""Merges folders that hold different samples of the same split, such as shards of several machines, into one
dataset.

Each sample's sidecar and files are read once, checked against their hashes, and written once. Memory holds only the
source folder of each sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from gear.dataset.files import inside, read_bytes, write_whole
from gear.dataset.guarded_paths import owned, remove_file, remove_tree
from gear.dataset.hashing import file_hash, in_threads
from gear.dataset.layout import GEAR, is_reserved, patch_path, sidecar_path, split_folder
from gear.dataset.locks import is_locked
from gear.dataset.plan import Plan, differences, read_plan, write_plan
from gear.dataset.reading import check_hash
from gear.dataset.sidecar import read_sidecar
from gear.dataset.store import plan_of
from gear.values.counted import counted
from gear.values.errors import DatasetError
from gear.values.progress import Progress
from gear.values.serial import Json

SAMPLES_AT_A_TIME = 256
"""Number of samples that are submitted to the copying threads at a time."""

MEASURED = 16
"""Largest number of samples, evenly spaced, from whose sizes the size of a split is estimated."""

TWICE = "belongs to two samples, or is another one in two of the folders"


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """The source folders that together hold all samples of one split.

    Attributes:
        plan: plan of the split, the same in each folder.
        roots: the folders.
        homes: for each sample, the positions in `roots` of the folders that hold it.
    """

    plan: Plan
    roots: tuple[Path, ...]
    homes: tuple[tuple[int, ...], ...]

    @property
    def split(self) -> str:
        """The name of the split."""
        return self.plan.info.split


def find_parts(roots: Sequence[Path], split: str, on_progress: Progress | None = None) -> Parts:
    """Finds the folder of each sample of a split; the plans of the split must be equal in all folders.

    Args:
        roots: datasets, not all of which need to have the split.
        split: name of the split.
        on_progress: called after every sample that is found with (found samples, samples of the split).

    Raises:
        DatasetError: two folders were made with different configurations, a run is writing into a folder, or a sample
            is in no folder.
    """
    having = tuple(root for root in roots if inside(root, f"{split_folder(split)}/plan.json").exists())
    plans = [plan_of(root, split) for root in having]
    for root, plan in zip(having, plans, strict=True):
        _refuse_other_plan(having[0], plans[0], root, plan)
        if is_locked(inside(root, split_folder(split))):
            raise DatasetError(root, f"a run is making split {split!r} just now; wait for its end")
    total = plans[0].samples
    homes: dict[int, list[int]] = {}  # grows with the sidecars that are there; the plan may name any number
    for position, root in enumerate(having):
        folder = inside(root, f"{split_folder(split)}/samples")
        for path in folder.glob("*.json") if folder.is_dir() else ():
            if path.stem.isdecimal() and path.stem == f"{int(path.stem):06d}" and int(path.stem) < total:
                homes.setdefault(int(path.stem), []).append(position)
                if on_progress is not None:
                    on_progress(len(homes), total)
    if len(homes) < total:
        first = next(index for index in range(total) if index not in homes)
        problem = f"{total - len(homes)} of {counted(total, 'sample')} of split {split!r} are in none of the folders"
        remedy = "collect the missing shard, or run the same `gear collect` without --shard in one of the folders"
        raise DatasetError(having[0], f"{problem} (first: sample {first}); {remedy}")
    return Parts(plan=plans[0], roots=having, homes=tuple(tuple(homes[index]) for index in range(total)))


def _refuse_other_plan(first_root: Path, first: Plan, root: Path, plan: Plan) -> None:
    """Checks that a folder has the same plan of the split as the first folder.

    Raises:
        DatasetError: the plans differ; the message names the differences.
    """
    places = (f"in {first_root}", f"in {root}")
    what = differences({"plan": first.as_json()}, {"plan": plan.as_json()}, places=places)
    if what:
        more = f" and {len(what) - 2} more" if len(what) > 2 else ""
        problem = f"split {plan.info.split!r} was made with another configuration"
        remedy = "merge only folders that the same command has made"
        raise DatasetError(root, f"{problem} ({'; '.join(what[:2])}{more}); {remedy}")


def prepare_merge(root: Path, plans: Sequence[Plan]) -> None:
    """Empties the target folder and writes the plans; files of an interrupted merge of the same splits are kept.

    Args:
        root: the target folder, which contains no link.
        plans: plans of the splits that are merged.

    Raises:
        DatasetError: a file cannot be written.
    """
    wanted = {plan.info.split: plan.as_json() for plan in plans}
    there: dict[str, Json] = {}
    for path in sorted(root.glob(f"{GEAR}/*/plan.json")):
        try:
            found = read_plan(root, path.parent.name)
        except DatasetError:
            found = None
        there[path.parent.name] = None if found is None else found.as_json()
    if any(wanted.get(split) != plan for split, plan in there.items()):
        for entry in sorted(root.iterdir()):
            (remove_file if entry.is_symlink() or not entry.is_dir() else remove_tree)(root, entry.name)
        there = {}
    for plan in plans:
        if there.get(plan.info.split) != wanted[plan.info.split]:
            write_plan(root, plan)


def copy_patches(parts: Parts, out: Path, check: Callable[[Mapping[str, Path]], None]) -> None:
    """Copies the pictures of the patch that a split shows into the target folder.

    Args:
        parts: the source folders; if several hold the pictures, they must be equal.
        out: the target folder.
        check: called with the paths of the pictures by name, before they are read whole; raises an error if they are
            not those of the plan.

    Raises:
        DatasetError: two folders have different pictures.
    """
    label = parts.plan.patch["label"]
    chosen: dict[str, bytes] = {}
    origin = parts.roots[0]
    for root in parts.roots:
        folder = inside(root, patch_path(label, "patch_0.png")).parent
        paths = {path.name: path for path in sorted(folder.glob("patch_*.png")) if inside(root, _of(root, path))}
        if not paths:
            continue
        if not chosen:
            check(paths)
            chosen = {name: read_bytes(path) for name, path in paths.items()}
            origin = root
        elif paths.keys() != chosen.keys() or not all(_holds(paths[name], data) for name, data in chosen.items()):
            raise DatasetError(folder, f"holds other pictures than {origin}; repair it with `gear verify`")
    for name, data in chosen.items():
        _put(out, patch_path(label, name), data)


def estimated_bytes(parts: Parts) -> float:
    """Estimates the number of bytes of a split's samples from some of them.

    Args:
        parts: the source folders.

    Raises:
        DatasetError: a sidecar (JSON file of a sample) cannot be read, or a path leads outside its folder.
    """
    total = len(parts.homes)
    chosen = sorted({round(number * (total - 1) / max(1, MEASURED - 1)) for number in range(MEASURED)}) if total else []
    sizes = []
    for index in chosen:
        root = parts.roots[parts.homes[index][0]]
        paths = [inside(root, name) for name in (sidecar_path(parts.split, index), *files_of(parts, root, index))]
        sizes.append(sum(path.stat().st_size for path in paths if path.is_file()))
    return total * sum(sizes) / max(1, len(sizes))


def copy_samples(parts: Parts, out: Path, on_progress: Progress) -> None:
    """Copies all samples of a split into the target folder: first the files of a sample, then its sidecar.

    Samples that an interrupted merge has copied are kept.

    Args:
        parts: the source folders.
        out: the target folder.
        on_progress: called after every sample.

    Raises:
        DatasetError: a file is missing or damaged, leads outside its folder, or two samples name the same file.
    """
    total = len(parts.homes)
    on_progress(0, total)
    for start in range(0, total, SAMPLES_AT_A_TIME):
        some = range(start, min(start + SAMPLES_AT_A_TIME, total))
        copy = partial(_copy_sample, parts, out, {})
        for index, _ in zip(some, in_threads(copy, some), strict=True):
            on_progress(index + 1, total)


def _copy_sample(parts: Parts, out: Path, hashes: dict[str, str], index: int) -> None:
    """Copies one sample from the first folder that has it.

    Args:
        parts, out: as of `copy_samples`.
        hashes: by path, of the files of samples that other threads copy at the same time; gets those of this one.
        index: of the sample.

    Raises:
        DatasetError: as `copy_samples`.
    """
    relative, data = sidecar_path(parts.split, index), sidecar_of(parts, index)
    first = parts.roots[parts.homes[index][0]]
    files = files_of(parts, first, index)
    if _holds(owned(out, relative), data) and all(  # of a merge that was stopped
        owned(out, name).is_file() and file_hash(owned(out, name)) == digest for name, digest in files.items()
    ):
        return
    for name, digest in sorted(files.items()):
        if hashes.setdefault(PurePosixPath(name).as_posix(), digest) != digest:
            raise DatasetError(owned(out, name), TWICE)
        _put(out, name, check_hash(first, name, digest))
    _put(out, relative, data)


def sidecar_of(parts: Parts, index: int) -> bytes:
    """The bytes of a sample's sidecar (JSON file of the sample), which must be equal in all folders that have it.

    Args:
        parts: the folders that are merged, by what they hold.
        index: index of the sample.

    Raises:
        DatasetError: two folders have different ones, or one cannot be read.
    """
    relative = sidecar_path(parts.split, index)
    first, *others = (parts.roots[position] for position in parts.homes[index])
    data = read_bytes(inside(first, relative))
    for other in others:
        if read_bytes(inside(other, relative)) != data:
            problem = f"is another sample than that of {first}; check both folders with `gear verify`"
            raise DatasetError(inside(other, relative), problem)
    return data


def files_of(parts: Parts, root: Path, index: int) -> Mapping[str, str]:
    """The hashes of a sample's files by path, as its sidecar (JSON file of the sample) in a folder names them.

    Args:
        parts: the folders that are merged, by what they hold.
        root: folder whose sidecar is read.
        index: index of the sample.

    Raises:
        DatasetError: the sidecar is damaged, or names a file that is no file of a sample.
    """
    path = inside(root, sidecar_path(parts.split, index))
    files = read_sidecar(path).files
    for name in files:
        if is_reserved(name, parts.split):
            raise DatasetError(path, f"names {name}, which is no file of a sample")
    return files


def _put(out: Path, relative: str, data: bytes) -> None:
    """Writes a file that is not there.

    Raises:
        DatasetError: a file of that name with other content is there.
    """
    target = owned(out, relative)
    if not target.exists():
        write_whole(out, relative, data)
    elif read_bytes(target) != data:
        raise DatasetError(target, TWICE)


def _holds(path: Path, data: bytes) -> bool:
    """Whether a file has these bytes; a file of another size is not read."""
    return path.is_file() and path.stat().st_size == len(data) and read_bytes(path) == data


def _of(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()
