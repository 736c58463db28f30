"""`gear.write_view`: writes the HTML page of a dataset."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.dataset.files import check_output_file, explained, streamed_alone
from gear.dataset.reading import Dataset
from gear.plugins.prediction_pictures import legends_json, picture_legends
from gear.plugins.text import printable
from gear.reporting.display import displayed
from gear.values.counted import counted
from gear.values.errors import DatasetError
from gear.values.progress import Callbacks, Progress
from gear.values.serial import Json
from gear.view.build import Builder, fitting_scale
from gear.view.document import document
from gear.view.drive_page import drive_page
from gear.view.drives import study_roots
from gear.view.rows import finite
from gear.view.sources import Source, open_compared, sources_of
from gear.view.streets import streets

MEGABYTE = 1_000_000
BASE64 = 4 / 3
"""Characters in the page per byte of an embedded picture (base64)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewReport:
    """The result of `gear.write_view`.

    Attributes:
        path: path of the page.
        samples: number of samples on the page.
        size_bytes: size of the page.
        scale: factor by which the embedded pictures were resized.
        problems: (index, problem) of the samples whose pictures or labels are incomplete.
        unit: what the page lists, `sample` or `drive`.
    """

    path: Path
    samples: int
    size_bytes: int
    scale: float
    problems: tuple[tuple[int, str], ...]
    unit: str = "sample"

    def summary(self) -> str:
        """Returns one line about the page, and a second line for the first problem if there are any."""
        size = f"{self.size_bytes / MEGABYTE:.1f} MB"
        scaled = "" if self.scale == 1 else f", pictures at {self.scale:.0%} of their width"
        text = f"{self.path}: {counted(self.samples, self.unit)}, {size}{scaled}"
        if self.problems:
            index, what = self.problems[0]
            where = f"{self.unit} {index}: " if index >= 0 else ""
            text += f"\n{len(self.problems)} not shown in full; first, {where}{printable(what)}"
        return text


def write_view(
    path: str | Path,
    out: str | Path = "view.html",
    *,
    twins: Sequence[str | Path] = (),
    evaluations: Sequence[str | Path] = (),
    split: str | None = None,
    samples: int | None = None,
    max_mb: float = 48.0,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> ViewReport:
    """Writes one self-contained HTML page of a dataset; it opens from disk, without a server or a network.

    With twins (datasets that differ only in their patch) and evaluations, the page also compares pictures and
    predictions with a slider, shows which objects a patch hides or invents, and sorts the samples by what changed most.

    All pictures are embedded at full size if they fit `max_mb`; otherwise all are embedded at the same smaller
    scale. In the second case, the view of a single sample loads the datasets' picture files, as long as these are not
    moved relative to the page.

    Args:
        path: root of a dataset of any task; or a folder of datasets that are twins; or the folder of an evaluation,
            which shows its first dataset and that dataset's twins; or a folder of `gear drive`, or a folder of several
            of them, whose drives are played.
        out: HTML file to write.
        twins: roots of datasets that differ from the first one only in their patch; `DIR:SPLIT` selects a split.
        evaluations: folders of `gear evaluate` with results for any of these datasets.
        split: the split to show; optional if there is only one.
        samples: number of samples or drives, counted from the first; all by default.
        max_mb: approximate limit for the size of the page in megabytes.
        progress: shows a progress bar.
        on_progress: called after every sample with the numbers of finished and of all samples.

    Raises:
        DatasetError: there is no finished split or drive to show, a dataset is no twin, an evaluation is of other
            datasets, or `out` cannot be written.
        UnknownNameError: the plugin of the dataset's task is not installed.
    """
    with displayed(Callbacks.of(on_progress=on_progress), "view", progress=progress) as shown:
        if studies := study_roots(path):
            if twins or evaluations or split is not None:
                raise DatasetError(path, "holds drives, which have no split and no evaluation, and know their twins")
            return write_drives(studies, out, drives=samples, max_mb=max_mb, on_progress=shown.on_progress)
        dataset, others, found = open_compared(path, twins, split)
        sources = sources_of(dataset, others, [*found, *evaluations], Path(out))
        return write_sources(sources, out, samples=samples, max_mb=max_mb, on_progress=shown.on_progress)


def write_page(
    dataset: Dataset[Any],
    out: str | Path,
    *,
    samples: int | None = None,
    max_mb: float = 48.0,
    on_progress: Progress | None = None,
) -> ViewReport:
    """Writes the HTML page of one dataset that is already open, without twins and evaluations.

    Args:
        dataset: the opened split.
        out: HTML file to write; missing folders are made.
        samples: number of samples, counted from the first; all by default.
        max_mb: approximate limit for the size of the page in megabytes.
        on_progress: called after every sample with the numbers of finished and of all samples.
    """
    sources = sources_of(dataset, (), (), Path(out))
    return write_sources(sources, out, samples=samples, max_mb=max_mb, on_progress=on_progress)


def write_drives(
    studies: Sequence[Path],
    out: str | Path,
    *,
    drives: int | None = None,
    max_mb: float = 48.0,
    on_progress: Progress | None = None,
) -> ViewReport:
    """Writes the HTML page of one or several studies of `gear drive`.

    Args:
        studies: folders of `gear drive`.
        out: HTML file to write; missing folders are made.
        drives: number of drives, counted from the first; None for all.
        max_mb: approximate limit for the size of the page in megabytes.
        on_progress: called after every drive with the numbers of finished and of all drives.

    Raises:
        DatasetError: there is no drive to show, or `out` cannot be written.
    """
    target = Path(out)
    _check_target(target)
    page = drive_page(studies, most=drives, budget_bytes=max_mb * MEGABYTE / BASE64, on_progress=on_progress)
    size = _write(target, page.document())
    return ViewReport(
        path=target,
        samples=len(page.motions),
        size_bytes=size,
        scale=page.scale,
        problems=page.problems,
        unit="drive",
    )


def write_sources(
    sources: tuple[Source, ...], out: str | Path, *, samples: int | None, max_mb: float, on_progress: Progress | None
) -> ViewReport:
    """Writes the HTML page of open datasets that are twins.

    Args:
        sources: the datasets with their evaluations; the page counts the samples of the first.
        out: HTML file to write; missing folders are made.
        samples: number of samples, counted from the first; None for all.
        max_mb: approximate limit for the size of the page in megabytes.
        on_progress: called after every sample with the numbers of finished and of all samples.
    """
    target, dataset = Path(out), sources[0].dataset
    _check_target(target)
    total = len(dataset)
    count = total if samples is None else min(samples, total)
    builder = Builder(sources=sources)
    scale = fitting_scale(builder, count, max_mb * MEGABYTE / BASE64) if count else 1.0
    builder = Builder(sources=sources, scale=scale)
    entries = list(builder.entries(count, on_progress))
    info = dataset.plan.info
    title = f"{dataset.plan.task['name']} · {info.scene} · {info.split}"
    size = _write(target, document(title, entries, about(sources, scale)))
    problems = tuple((entry.row["index"], entry.problem) for entry in entries if entry.problem)
    return ViewReport(path=target, samples=count, size_bytes=size, scale=scale, problems=problems)


def about(sources: Sequence[Source], scale: float) -> dict[str, Json]:
    """Returns the metadata of the whole split for the page, as JSON: task, town with its streets, scene, split, seed,
    patch and config, legends of the pictures, and labels of the compared datasets and evaluations.

    Args:
        sources: the datasets of the page with their evaluations; the metadata are those of the first dataset.
        scale: factor by which the pictures of the page were resized.
    """
    dataset = sources[0].dataset
    plan = dataset.plan
    known = {key: value for key, value in dataset.manifest.items() if key not in ("samples", "indexes", "sidecars")}
    named = {"task": plan.task, "options": plan.options, "content": plan.content, "patch": plan.patch}
    info = plan.info
    return {
        "name": dataset.root.resolve().name,
        "task": plan.task["name"],
        "town": info.town,
        "scene": info.scene,
        "split": info.split,
        "seed": info.seed,
        "patch": info.patch_label,
        "total": len(dataset),
        "scale": scale,
        "datasets": [source.label for source in sources],
        "evaluations": list(dict.fromkeys(part.label for source in sources for part in source.evaluated)),
        "legends": _legends(dataset),
        "streets": streets(info.town),
        "facts": finite(known | named),
    }


def _legends(dataset: Dataset[Any]) -> Json:
    """Returns the legends of the task's pictures as JSON; none if the task's function fails."""
    try:
        return legends_json(picture_legends(dataset.task))
    except Exception:  # a third party's code; the page is useful without legends
        return {}


def _check_target(target: Path) -> None:
    """Makes the folder of the page before the work begins.

    Raises:
        DatasetError: the page would be a folder, or its folder cannot be made.
    """
    check_output_file(target)
    with explained(target):
        target.parent.mkdir(parents=True, exist_ok=True)


def _write(target: Path, pieces: Iterable[str]) -> int:
    """Writes the file atomically and returns its size in bytes."""
    with streamed_alone(target) as stream:
        return sum(stream.write(piece.encode("utf-8", errors="replace")) for piece in pieces)
