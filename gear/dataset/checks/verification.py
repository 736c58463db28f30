"""Checks that every file of a dataset exists and has the bytes that gear wrote.

Every byte is covered by a hash. The sidecar of a sample holds the hashes of its pictures, labels and probes. The
manifest holds the hashes of sidecars, index files and patches. Sidecars, manifest and plan also contain a hash of their
own content (`gear.dataset.sealed_json`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Literal

from gear.dataset.checks.salvage import files_below, listed_hashes
from gear.dataset.failures import failures_folder
from gear.dataset.files import inside
from gear.dataset.find_datasets import no_dataset
from gear.dataset.hashing import file_hash, in_threads
from gear.dataset.layout import GEAR, is_temporary, manifest_path, patch_path, plan_path, sidecar_path, split_folder
from gear.dataset.plan import Plan, read_plan
from gear.dataset.scratch import SCRATCH
from gear.dataset.sealed_json import load_sealed
from gear.dataset.sidecar import read_sidecar
from gear.values.counted import counted
from gear.values.errors import DatasetError
from gear.values.progress import Progress
from gear.values.serial import Json

Problem = Literal["damaged", "missing", "unexpected", "unchecked"]

MOST_MISSING = 10_000
"""Largest number of missing samples that are listed one by one, because a plan of unknown origin may name any number of
samples.
"""


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Finding:
    """One file that is damaged, missing or unexpected, or cannot be checked.

    Attributes:
        path: path relative to the dataset's root.
        problem: `damaged` if the bytes are not those that were written; `missing`; or `unexpected` for a file that does
            not belong to the dataset, in a folder that readers of the format list; `unchecked` if the hash of the file
            is unknown, because the files that list it are damaged.
        detail: further explanation as text.
    """

    path: str
    problem: Problem
    detail: str = ""

    def line(self) -> str:
        """The problem, the path and the explanation as one line of text."""
        return f"{self.problem:<10} {self.path}" + f" ({self.detail})" * bool(self.detail)


@dataclass(slots=True, kw_only=True)
class SplitCheck:
    """The result of the check of one split.

    Attributes:
        split: name of the split.
        plan: plan of the split (everything that decides its bytes); None if it is missing or damaged.
        manifest: manifest of the split (JSON with the hashes of all files); None if it is missing or damaged.
        samples: number of samples that the split should hold.
        broken_samples: indices of samples with a missing or damaged file or sidecar.
        known: paths of all files that belong to the split.
        findings: files of the split that are damaged or missing.
        unreadable: damaged manifest and sidecars, whose lists of files and hashes cannot be relied on.
    """

    split: str
    plan: Plan | None = None
    manifest: Json = None
    samples: int = 0
    broken_samples: set[int] = field(default_factory=set)
    known: set[str] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)
    unreadable: set[str] = field(default_factory=set)

    def found(self, path: str, problem: Problem, detail: str = "") -> None:
        """Adds a file that is damaged, missing or unexpected to the result.

        Args:
            path: path of the file relative to the dataset's root.
            problem: kind of the problem.
            detail: explanation for the message; "" for none.
        """
        self.findings.append(Finding(path=path, problem=problem, detail=detail))


def splits_in(root: Path) -> list[str]:
    """The names of a dataset's splits, sorted; a split whose plan is missing is included if it has samples or a
    manifest.

    Args:
        root: folder of the dataset.

    Raises:
        DatasetError: the folder has no split.
    """
    entries = [*root.glob(f"{GEAR}/*/plan.json"), *root.glob(f"{GEAR}/*/manifest.json")]
    names = {path.parent.name for path in entries} | {path.parent.name for path in root.glob(f"{GEAR}/*/samples")}
    if not names:
        raise no_dataset(root)
    return sorted(names)


def check_split(root: Path, split: str, on_progress: Progress | None = None) -> SplitCheck:
    """Checks all files of one split.

    Args:
        root: root of the dataset.
        split: name of the split.
        on_progress: called with (number of checked samples, total number of samples) after every sample.

    Raises:
        DatasetError: a file cannot be read, or lies outside the root.
    """
    check = SplitCheck(split=split)
    _check_plan(root, check)
    _check_manifest(root, check)
    _check_samples(root, check, on_progress)
    if isinstance(check.manifest, dict):
        _check_listed(root, check, check.manifest.get("indexes"))
        _check_listed(root, check, check.manifest.get("patches"))
    if check.unreadable:
        _check_salvaged(root, check)
    _check_failure_notes(root, check)
    label = check.plan.patch["label"] if check.plan is not None else ""
    check.known |= {
        _relative(root, path) for path in inside(root, patch_path(label or "none", "x")).parent.glob("*.png")
    }
    return check


def unexpected_files(root: Path, checks: Iterable[SplitCheck]) -> list[Finding]:
    """Finds files that belong to no split, in folders that contain files of splits; hidden files are skipped.

    Files in the root itself, and folders into which gear wrote nothing, belong to the user. If a manifest is missing or
    damaged, the index files of its split are unknown. In this case only temporary files of interrupted runs are
    reported.

    Args:
        root: root of the dataset.
        checks: results of `check_split` for all splits.
    """
    checks = list(checks)
    known = {path for check in checks for path in check.known}
    folders = {str(Path(path).parent) for path in known} | {split_folder(check.split) for check in checks}
    found = []
    is_known = all(check.manifest is not None for check in checks)
    for folder in sorted(folders - {".", GEAR}) if is_known else ():
        place = inside(root, folder)
        for path in sorted(place.iterdir()) if place.is_dir() else ():
            relative = _relative(root, path)
            if relative not in known and not path.name.startswith(".") and not path.is_dir():
                found.append(Finding(path=relative, problem="unexpected"))
    if any(check.unreadable for check in checks):
        found += _unchecked(root, known)
    leftovers = [
        path
        for check in checks
        for kind in ("begun/*.json", "claims/*.claim")
        for path in inside(root, split_folder(check.split)).glob(kind)
    ]
    leftovers += [
        path
        for check in checks
        for path in inside(root, failures_folder(check.split)).glob("*.json")
        if path.stem.isdecimal() and inside(root, sidecar_path(check.split, int(path.stem))).exists()
    ]
    leftovers += inside(root, SCRATCH).glob("*")
    found += [
        Finding(path=_relative(root, path), problem="unexpected", detail="left by a run that was stopped")
        for path in sorted(leftovers)
    ]
    return found


def _check_plan(root: Path, check: SplitCheck) -> None:
    relative = plan_path(check.split)
    check.known.add(relative)
    if not inside(root, relative).exists():
        check.found(relative, "missing")
        return
    try:
        check.plan = read_plan(root, check.split)
    except DatasetError as error:
        check.found(relative, "damaged", error.problem.partition(";")[0])
    else:
        check.samples = check.plan.samples if check.plan is not None else 0


def _check_manifest(root: Path, check: SplitCheck) -> None:
    relative = manifest_path(check.split)
    check.known.add(relative)
    if not inside(root, relative).exists():
        check.found(relative, "missing", "the split is not finished")
        return
    try:
        manifest = load_sealed(inside(root, relative))
        samples = [dict(one["files"]) for one in manifest["samples"]]
        dict(manifest["indexes"])
    except DatasetError as error:
        check.found(relative, "damaged", error.problem.partition(";")[0])
        check.unreadable.add(relative)
    except (KeyError, TypeError, ValueError):
        check.found(relative, "damaged", "it lists no files")
        check.unreadable.add(relative)
    else:
        if check.plan is not None and manifest.get("content_key") != check.plan.content_key:
            check.found(plan_path(check.split), "damaged", "it is not the plan that the manifest was written for")
            check.plan, check.samples = None, 0
        check.manifest, check.samples = manifest, max(check.samples, len(samples))


def _check_samples(root: Path, check: SplitCheck, on_progress: Progress | None) -> None:
    folder = inside(root, f"{split_folder(check.split)}/samples")
    numbers = {int(path.stem) for path in folder.glob("*.json") if path.stem.isdecimal()}
    if not check.samples:  # neither the plan nor the manifest says how many
        check.samples = max(numbers, default=-1) + 1
    manifest = check.manifest if isinstance(check.manifest, dict) else {}
    listed, hashes = manifest.get("samples", []), manifest.get("sidecars", {})
    known = {*range(len(listed)), *(index for index in numbers if index < check.samples)}
    absent = list(islice((index for index in range(check.samples) if index not in known), MOST_MISSING + 1))
    indices = sorted(known)
    if on_progress is not None:
        on_progress(0, len(indices))

    def findings(index: int) -> list[Finding]:
        entry = listed[index]["files"] if index < len(listed) else {}
        return list(_sample_findings(root, check, index, hashes, entry))

    for done, (index, found) in enumerate(zip(indices, in_threads(findings, indices), strict=True), 1):
        check.findings += found
        if found:
            check.broken_samples.add(index)
        if on_progress is not None:
            on_progress(done, len(indices))
    # No look at the disk for each missing sample: the plan of a stranger may claim any number of samples.
    for number, index in enumerate(absent):
        if number < MOST_MISSING:
            check.found(sidecar_path(check.split, index), "missing")
            check.known.add(sidecar_path(check.split, index))
            check.broken_samples.add(index)
        else:
            more = counted(check.samples - len(known) - MOST_MISSING - 1, "more sample")
            check.found(sidecar_path(check.split, index), "missing", f"and {more}")


def _sample_findings(
    root: Path, check: SplitCheck, index: int, hashes: dict[str, str], listed: dict[str, str]
) -> Iterator[Finding]:
    """The damaged and missing files of a sample, by its sidecar or, if that is damaged, by the manifest."""
    relative = sidecar_path(check.split, index)
    path = inside(root, relative)
    files = dict(listed)
    check.known.add(relative)
    if not path.exists():
        yield Finding(path=relative, problem="missing")
    else:
        try:
            sidecar = read_sidecar(path)
            if relative in hashes and file_hash(path) != hashes[relative]:
                yield Finding(path=relative, problem="damaged", detail="it is not the sidecar that the manifest names")
            else:
                files = dict(sidecar.files)
                if listed not in ({}, files):
                    detail = f"its hashes of sample {index} are not those of the sidecar"
                    yield Finding(path=manifest_path(check.split), problem="damaged", detail=detail)
        except DatasetError as error:
            yield Finding(path=relative, problem="damaged", detail=error.problem.partition(";")[0])
            if not listed:
                check.unreadable.add(relative)
    check.known |= files.keys()
    for name, digest in files.items():
        yield from _file_findings(root, name, digest)


def _check_failure_notes(root: Path, check: SplitCheck) -> None:
    """Checks the notes on samples that could not be made; a note is damaged together with its missing sample."""
    for path in sorted(inside(root, failures_folder(check.split)).glob("*.json")):
        if not path.stem.isdecimal() or inside(root, sidecar_path(check.split, int(path.stem))).exists():
            continue  # `unexpected_files` reports it
        check.known.add(_relative(root, path))
        try:
            load_sealed(path)
        except DatasetError as error:
            check.found(_relative(root, path), "damaged", error.problem.partition(";")[0])


def _check_salvaged(root: Path, check: SplitCheck) -> None:
    """Checks the files that only damaged manifests and sidecars list, with the hashes that are still readable there."""
    hashes = listed_hashes(root, check.unreadable)
    for relative in sorted(hashes.keys() - check.known):
        check.known.add(relative)
        path = inside(root, relative)
        if not path.exists():
            check.found(relative, "missing")
        elif not path.is_file() or file_hash(path) not in hashes[relative]:
            check.found(relative, "damaged")


def _unchecked(root: Path, known: set[str]) -> list[Finding]:
    """The files of a dataset that cannot be checked: damaged files are the only ones that could list them.

    Args:
        root: root of the dataset.
        known: paths of the files whose hashes are known. If one of them lies outside of `gear/`, only folders of known
            files are searched, because other folders may belong to the user.
    """
    tops = {Path(path).parts[0] for path in known if "/" in path}
    detail = "the files that list it are damaged"
    return [
        Finding(path=path, problem="unchecked", detail=detail)
        for path in files_below(root)
        if path not in known and "/" in path and not is_temporary(path)
        if tops == {GEAR} or Path(path).parts[0] in tops
    ]


def _check_listed(root: Path, check: SplitCheck, hashes: Json) -> None:
    """Checks files that the manifest names with their hashes."""
    for relative, digest in hashes.items() if isinstance(hashes, dict) else ():
        check.known.add(relative)
        check.findings += _file_findings(root, relative, digest)


def _file_findings(root: Path, relative: str, digest: str) -> Iterator[Finding]:
    path = inside(root, relative)
    if not path.exists():
        yield Finding(path=relative, problem="missing")
    elif not path.is_file() or file_hash(path) != digest:
        yield Finding(path=relative, problem="damaged")


def _relative(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()
