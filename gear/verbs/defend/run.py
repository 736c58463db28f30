"""`gear.defend`: applies a defense to the pictures of a dataset."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.specs import DefenseSpec
from gear.dataset.files import clear_scratch, explained, inside, write_whole
from gear.dataset.free_space import check_free_space
from gear.dataset.json_text import dump_json, load_json
from gear.dataset.store import check_output
from gear.measuring.checked_defense import CheckedDefense
from gear.plugins.build import NO_OPTIONS, build, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.datasets import open_dataset
from gear.reporting.display import displayed
from gear.values.counted import counted
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks, Progress
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.defend.cleaned import FOLDER, kept_marker, marker_path, write_sample
from gear.verbs.defend.request import DefendRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class DefendReport:
    """The result of `gear.defend`.

    Attributes:
        root: folder of the cleaned pictures.
        split: name of the split.
        samples: number of cleaned samples of the split.
        made: number of samples cleaned by this run.
        outdated: how many of the samples in `made` replace earlier results, because the source pictures changed or
            files were damaged.
    """

    root: Path
    split: str
    samples: int
    made: int
    outdated: int = 0

    def summary(self) -> str:
        """Returns the result as one line of text."""
        kept = self.samples - self.made
        resumed = f" ({kept} were there already)" if kept else ""
        again = f"; {self.outdated} were cleaned again: their pictures or files had changed" if self.outdated else ""
        return f"{self.root}: {counted(self.samples, 'sample')} of split {self.split!r} cleaned{resumed}{again}"


def defend(
    dataset: str | Path,
    *,
    defense: str,
    out: str | Path,
    split: str | None = None,
    settings: Iterable[str] = (),
    seed: int = 0,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> DefendReport:
    """Applies a defense to the pictures of a dataset and writes the cleaned pictures.

    An interrupted run is resumed. Samples whose source pictures changed, or whose files are damaged, are cleaned again.
    The cleaned pictures have the same relative paths as in the dataset. If the defense returns masks, they are written
    to `defense/<split>/masks/<index>_<camera>.png` (16 bits, 65535 is 1); scores are written to
    `defense/<split>/scores.json`.

    Args:
        dataset: root of a dataset of any task.
        defense: name of a defense plugin.
        out: folder for the cleaned pictures; it may contain other splits of the same dataset.
        split: split of the dataset; optional if there is only one.
        settings: `KEY=VALUE` texts for the defense's options.
        seed: seed of the defense's random draws.
        progress: shows a progress bar.
        on_progress: called after every sample with the numbers of finished and of all samples.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = DefendRequest(dataset=dataset, defense=defense, out=out, split=split, settings=tuple(settings), seed=seed)
    with displayed(Callbacks.of(on_progress=on_progress), "defend", progress=progress) as shown:
        return run_defend(request, shown)


def run_defend(request: DefendRequest, callbacks: Callbacks) -> DefendReport:
    """Cleans the pictures of a dataset with the arguments in `request`, which `gear.defend` describes; samples that an
    earlier run has cleaned are kept.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    found = find("defense", request.defense)
    options = with_overrides(NO_OPTIONS, request.settings)
    config = read_node(found.spec.config, options, "")
    opened = open_dataset(request.dataset, request.split)
    spec = suitable(found, opened.plan.task["name"])
    root, name, count = Path(request.out), opened.plan.info.split, len(opened)
    check_output(root, "write the cleaned pictures into a folder of their own")
    plan: Json = {
        "defense": {"name": spec.name, "package": found.owner.package, "version": found.owner.version},
        "options": to_plain(config),
        "seed": request.seed,
        "dataset": opened.plan.content_key,
        "split": name,
    }
    begin(root, name, plan)
    guard = CheckedDefense(found, build(found, options))
    markers = {i: kept_marker(root, opened, i, spec) for i in range(count)}
    missing = [i for i, marker in markers.items() if marker is None]
    outdated = sum(inside(root, marker_path(name, i)).exists() for i in missing)
    callbacks.on_progress(count - len(missing), count)
    for finished, index in enumerate(missing, count - len(missing) + 1):
        sample = opened[index]
        result = guard.apply(sample.images, derive_rng(request.seed, "defend", spec.name, index), index)
        markers[index] = marker = write_sample(root, opened, index, sample, spec, result)
        if finished == count - len(missing) + 1:
            check_free_space(
                root,
                (len(missing) - 1) * sum(inside(root, path).stat().st_size for path in marker.files),
                what=f"{counted(len(missing) - 1, 'more cleaned sample')} will need",
                advice="give --out on another disk",
            )
        callbacks.on_progress(finished, count)
    if "score" in spec.outputs:
        scores = [marker.score for marker in markers.values() if marker is not None]
        write_whole(root, f"{FOLDER}/{name}/scores.json", dump_json({"scores": scores}))
    clear_scratch(root)
    return DefendReport(root=root, split=name, samples=count, made=len(missing), outdated=outdated)


def suitable(plugin: PluginEntry, task: str) -> DefenseSpec[Any]:
    """Returns the spec of a defense after checking that the defense needs nothing but pictures.

    Args:
        plugin: plugin of the defense.
        task: name of the dataset's task.

    Raises:
        GearError: the defense is not for the task, or needs a model or calibration data.
    """
    spec = plugin.spec
    assert isinstance(spec, DefenseSpec)
    if spec.tasks and task not in spec.tasks:
        raise GearError(f"defense {spec.name!r} is for {', '.join(spec.tasks)}; this is a {task} dataset")
    if spec.taps or spec.needs_model:
        raise GearError(f"defense {spec.name!r} looks into a model; cleaning pictures alone is not enough for it")
    if spec.needs_calibration:
        raise GearError(f"defense {spec.name!r} must learn from clean and patched samples first; gear defend has none")
    return spec


def begin(root: Path, split: str, plan: Json) -> None:
    """Writes the plan of the run (defense, options, seed, dataset), or checks that an existing plan is equal.

    Args:
        root: output folder.
        split: name of the split.
        plan: inputs of the run, as JSON.

    Raises:
        DatasetError: the existing plan differs, or a file cannot be written.
    """
    relative = f"{FOLDER}/{split}/plan.json"
    with explained(root):
        root.mkdir(parents=True, exist_ok=True)
    path = inside(root, relative)
    is_begun = next((path.parent / "samples").glob("*.json"), None) is not None
    if not (is_begun and path.exists()):
        write_whole(root, relative, dump_json(plan))
        return
    try:
        there = load_json(path)
    except DatasetError as error:
        problem = f"{error.problem.partition(';')[0]}; use another --out, or delete this folder"
        raise DatasetError(path, problem) from error
    if there != plan:
        keys = there.keys() | plan.keys() if isinstance(there, dict) else {"plan"}
        differs = sorted(key for key in keys if not isinstance(there, dict) or there.get(key) != plan.get(key))
        raise DatasetError(
            root, f"split {split!r} was cleaned with other settings ({', '.join(differs)} differ); use another --out"
        )
