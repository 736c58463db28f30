"""`gear.verify`: checks every file of a dataset, and can make damaged samples again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gear.collecting.devices import has_mixed_devices
from gear.collecting.run import executor_of, run_job
from gear.dataset.checks.exported_files import AGAIN, check_export, list_of_export
from gear.dataset.checks.salvage import restored
from gear.dataset.checks.verification import Finding, SplitCheck, check_split, splits_in, unexpected_files
from gear.dataset.files import inside, read_bytes, write_whole
from gear.dataset.finishing.cards import damaged_cards, own_cards, write_cards
from gear.dataset.guarded_paths import refuse_links, remove_files
from gear.dataset.layout import GEAR, plan_path, sidecar_path, split_folder
from gear.dataset.locks import dataset_lock, is_locked
from gear.dataset.plan import read_plan, write_plan
from gear.reporting.display import displayed
from gear.values.errors import DatasetError
from gear.values.progress import Callbacks, Progress
from gear.verbs.verify.recipe import Sources, job_of
from gear.verbs.verify.report import VerifyReport


def verify(
    dataset: str | Path,
    *,
    split: str | None = None,
    repair: bool = False,
    patch: str | Path | None = None,
    town: str | Path | None = None,
    scenes: str | Path | None = None,
    simulation: str | Path | None = None,
    workers: int = 1,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> VerifyReport:
    """Checks that every file of a dataset, or of an export, has the bytes that gear wrote, and that no file is missing.

    A repair makes damaged and missing files again: samples, indexes, manifest, plan and copies of patches. With the
    same versions, renderer and device, the repaired dataset has its original bytes. If other bytes would result,
    nothing is changed. Files that do not belong to the dataset are reported and not deleted.

    Args:
        dataset: root of a dataset, or folder of `gear export`, which can be checked as a whole and not be repaired.
        split: the split to check; all by default.
        repair: whether damaged and missing files are made again.
        patch: for a repair, the patch in the pictures, if the dataset's copy of the patch is damaged.
        town: for a repair, the MJCF file of a town that is not part of gear.
        scenes: for a repair, the scene library of that town.
        simulation: for a repair, the simulation config, if it is not part of gear.
        workers: number of processes that make samples again.
        progress: whether to show the progress on stderr.
        on_progress: called with (samples, samples of the split), while a split is checked and while it is repaired.

    Raises:
        DatasetError: the folder is not a dataset, a file cannot be read, or a path leads outside of the dataset.
    """
    sources = Sources(patch=patch, town=town, scenes=scenes, simulation=simulation)
    with displayed(Callbacks.of(on_progress=on_progress), "verify", progress=progress) as callbacks:
        return _verified(Path(dataset), split, sources if repair else None, workers, callbacks)


def _verified(
    root: Path, split: str | None, sources: Sources | None, workers: int, callbacks: Callbacks
) -> VerifyReport:
    """Checks a dataset, and repairs it if `sources` is not None; an export is only checked."""
    listed = None if (root / GEAR).is_dir() else list_of_export(root)
    if listed is not None:
        if split is not None or sources is not None:
            raise DatasetError(root, f"is an export, of which only all files can be checked; if damaged, {AGAIN}")
        count, damaged = check_export(root, listed, callbacks.part("checking files"))
        return VerifyReport(root=root, files=count, findings=tuple(damaged))
    names = splits_in(root)
    if split is not None and split not in names:
        raise DatasetError(root, f"has no split {split!r}; there are: {', '.join(names)}")
    chosen = names if split is None else [split]
    checks = {name: check_split(root, name, callbacks.on_progress if name in chosen else None) for name in names}
    findings = _findings(root, checks, chosen)
    if sources is not None:
        refuse_links(root)
        if not findings:
            write_cards(root)  # which may be missing
    if sources is None or not findings:
        return VerifyReport(root=root, files=_count(root, checks, chosen, findings), findings=tuple(findings))
    unrepaired: list[str] = []
    notes: list[str] = []
    leftovers = any(one.detail for one in findings if one.problem == "unexpected")
    for name in chosen:
        if checks[name].findings or leftovers:
            try:
                notes += _repair(root, checks[name], sources, workers, callbacks)
            except DatasetError as error:
                unrepaired.append(str(error))
    write_cards(root, is_repair=True)
    checks |= {name: check_split(root, name, callbacks.part("checking repaired samples")) for name in chosen}
    left = _findings(root, checks, chosen)
    paths = {one.path for one in left}
    return VerifyReport(
        root=root,
        files=_count(root, checks, chosen, left),
        findings=tuple(left),
        repaired=tuple(one for one in findings if one.path not in paths and one.problem != "unchecked"),
        unrepaired=tuple(unrepaired),
        notes=tuple(notes),
    )


def _findings(root: Path, checks: dict[str, SplitCheck], chosen: Sequence[str]) -> list[Finding]:
    """Returns the faulty files of the chosen splits and of the dataset's cards (its README and its Croissant metadata).

    Files that belong to no split are found only if all splits are checked.
    """
    found = [finding for name in chosen for finding in checks[name].findings]
    found += [Finding(path=path, problem="damaged") for path in damaged_cards(root)]
    unexpected = unexpected_files(root, checks.values())
    if len(chosen) < len(checks):
        folders = tuple({f"{Path(path).parent}/" for name in chosen for path in checks[name].known})
        unexpected = [one for one in unexpected if one.path.startswith(folders)]
    return list(dict.fromkeys([*found, *unexpected]))


def _count(root: Path, checks: dict[str, SplitCheck], chosen: Sequence[str], findings: Sequence[Finding]) -> int:
    found = {one.path for one in findings if one.problem != "unexpected"}
    return len({path for name in chosen for path in checks[name].known} | own_cards(root) | found)


def _repair(root: Path, check: SplitCheck, sources: Sources, workers: int, callbacks: Callbacks) -> list[str]:
    """Makes the damaged and missing files of a split again.

    Returns:
        A note if the new files may differ from the original ones; otherwise nothing.

    Raises:
        DatasetError: it is not recorded how the split was made, other bytes would be made on this machine, or another
            run is writing the split.
    """
    _restore_plan(root, check)
    job = job_of(root, check, sources)
    with dataset_lock(root):
        if is_locked(root / split_folder(check.split)):
            raise DatasetError(root, f"a run is making split {check.split!r} just now; wait for its end")
        if check.plan is None:
            write_plan(root, job.plan)
        remove_files(root, [sidecar_path(check.split, index) for index in sorted(check.broken_samples)])
    run_job(job, executor=executor_of(job, workers, in_subprocess=False), callbacks=callbacks)
    if not has_mixed_devices(job.plan.content):
        return []
    return [
        f"split {check.split!r} has samples of different graphics devices; the repaired samples may differ from the "
        "original ones in last bits"
    ]


def _restore_plan(root: Path, check: SplitCheck) -> None:
    """Restores a plan in which one byte was changed, if the manifest is damaged as well.

    Without either of them it is unknown how the split was made. The hash in the plan proves that the restored content
    is the original.
    """
    path = inside(root, plan_path(check.split))
    if check.plan is not None or check.manifest is not None or not path.is_file():
        return
    content = restored(read_bytes(path))
    if content is not None:
        with dataset_lock(root):
            write_whole(root, plan_path(check.split), content)
        check.plan = read_plan(root, check.split)
