"""`gear.import_archive`: unpacks a dataset from a tar or zip archive, checks every hash, and writes it whole or not at
all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from gear.dataset.checks.verification import check_split, splits_in
from gear.dataset.files import write_whole
from gear.dataset.finishing.cards import damaged_cards, own_cards
from gear.dataset.free_space import check_free_space
from gear.dataset.guarded_paths import remove_empty_folders, remove_files
from gear.dataset.layout import GEAR
from gear.dataset.scratch import clear_scratch
from gear.dataset.whole_tree import check_target, whole_tree
from gear.plugins.text import printable
from gear.reporting.display import displayed
from gear.values.counted import counted
from gear.values.errors import DatasetError
from gear.values.progress import Callbacks, Progress
from gear.verbs.import_archive.members import Archive, Member


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportReport:
    """The result of `gear.import_archive`.

    Attributes:
        root: root of the new dataset.
        splits: names of its splits.
        files: number of its files.
        left_out: paths of files in the archive that do not belong to the dataset; they are not unpacked.
    """

    root: Path
    splits: tuple[str, ...]
    files: int
    left_out: tuple[str, ...]

    def summary(self) -> str:
        """Returns the result as text; a second line names files that were left out."""
        splits = printable(", ".join(self.splits))
        text = f"{self.root}: {splits}; {counted(self.files, 'file')}, all as they were written"
        if self.left_out:
            first = printable(self.left_out[0])
            text += f"\n{counted(len(self.left_out), 'file')} not of the dataset left out; first, {first}"
        return text


def import_archive(
    archive: str | Path,
    *,
    out: str | Path,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> ImportReport:
    """Unpacks a dataset from an archive into a new folder.

    All members of the archive are checked before anything is written: links, absolute paths, `..`, devices, duplicate
    names and archives that unpack to a hundred times their size are refused. The dataset is unpacked into a hidden
    folder next to `out`, all hashes are checked, and the folder is renamed. After an error nothing remains. No code of
    the archive is run.

    Args:
        archive: tar archive (plain, gzip, bzip2 or xz) or zip archive of one dataset's root folder.
        out: folder of the new dataset; must be empty or new.
        progress: shows a progress bar.
        on_progress: called after every file with (unpacked files, files of the archive).

    Raises:
        DatasetError: the archive is damaged or could do harm, holds no dataset or several, a file of the dataset is
            missing or has another hash, or `out` is not empty.
        GearError: the disk is too small.
    """
    with displayed(Callbacks.of(on_progress=on_progress), "import", progress=progress, unit="file") as shown:
        return _imported(Path(archive), Path(out), shown)


def _imported(path: Path, out: Path, callbacks: Callbacks) -> ImportReport:
    """Unpacks an archive and checks the files."""
    target = out.resolve()
    check_target(target, "import")
    callbacks.part("reading the list of files in the archive")
    with Archive(path) as opened:
        root = _root_in(path, opened.members)
        wanted = [member for member in opened.members if PurePosixPath(member.path).is_relative_to(root)]
        chosen = {member.path for member in wanted}
        outside = [member.path for member in opened.members if member.path not in chosen]
        size = sum(member.size for member in wanted)
        check_free_space(target, size, what="the dataset needs", advice="give --out on another disk")
        with whole_tree(target, "import", is_continued=False) as unfinished:
            for done, (member, data) in enumerate(opened.files(), start=1):
                if member.path in chosen:
                    write_whole(unfinished, PurePosixPath(member.path).relative_to(root).as_posix(), data)
                callbacks.on_progress(done, len(opened.members))
            known, splits = _checked(path, unfinished, callbacks.part("checking samples"))
            inner = [PurePosixPath(member.path).relative_to(root).as_posix() for member in wanted]
            surplus = [one for one in inner if one not in known]
            remove_files(unfinished, surplus)
            for folder in sorted({PurePosixPath(one).parts[0] for one in surplus if "/" in one}):
                remove_empty_folders(unfinished, folder)
            clear_scratch(unfinished)
    return ImportReport(root=out, splits=splits, files=len(inner) - len(surplus), left_out=(*surplus, *outside))


def _root_in(archive: Path, members: Sequence[Member]) -> PurePosixPath:
    """Returns the path of the dataset's root in the archive; `.` if the dataset is not in a folder.

    Raises:
        DatasetError: the archive holds no dataset, or several.
    """
    paths = (PurePosixPath(member.path) for member in members)
    plans = (path.parents[2] for path in paths if path.name == "plan.json" and path.parts[-3:-2] == (GEAR,))
    roots = sorted(set(plans))
    if not roots:
        raise DatasetError(archive, f"holds no dataset of gear (no {GEAR}/<split>/plan.json)")
    if len(roots) > 1:
        listed = ", ".join(str(root) for root in roots[:5])
        raise DatasetError(archive, f"holds {len(roots)} datasets ({printable(listed)}); make one archive of each")
    return roots[0]


def _checked(archive: Path, root: Path, on_progress: Progress) -> tuple[set[str], tuple[str, ...]]:
    """Checks every file of an unpacked dataset.

    Returns:
        The paths of all files of the dataset, and the names of its splits.

    Raises:
        DatasetError: a file is damaged or missing.
    """
    names = splits_in(root)
    checks = [check_split(root, name, on_progress) for name in names]
    findings = [(one.path, one.problem) for check in checks for one in check.findings]
    findings += [(path, "damaged") for path in damaged_cards(root)]
    if findings:
        (first, problem), more = findings[0], len(findings) - 1
        further = f", and {more} more" if more else ""
        raise DatasetError(
            archive, f"holds a damaged dataset: {printable(first)} is {problem}{further}; nothing was written"
        )
    return {path for check in checks for path in check.known} | set(own_cards(root)), tuple(names)
