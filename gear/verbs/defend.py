"""`gear.defend`: a dataset's pictures, cleaned by a defense."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.defenses import Defense, DefenseResult
from gear.contracts.models import Model
from gear.contracts.specs import DefenseSpec
from gear.dataset.files import clear_scratch, explained, inside, write_whole
from gear.dataset.sidecar import dump_json, load_json
from gear.dataset.store import refuse_dataset
from gear.opening import open_dataset
from gear.plugins.build import NO_OPTIONS, blamed, build, find
from gear.plugins.catalogue import Found
from gear.values.errors import DatasetError, GearError, PluginError
from gear.values.frames import UInt8Image
from gear.values.rng import check_seed, derive_rng
from gear.values.serial import Json
from gear.verbs.cleaned import FOLDER, kept_marker, marker_path, write_sample

Progress = Callable[[int, int], None]
"""Called with (samples finished, samples of the split)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DefendReport:
    """What a run did.

    Attributes:
        root: folder of the cleaned pictures.
        split: its name.
        samples: how many of the split are cleaned now.
        made: how many of them this run cleaned.
        outdated: how many of these had been cleaned before, of pictures that are others now, or into files that are
            damaged.
    """

    root: Path
    split: str
    samples: int
    made: int
    outdated: int = 0

    def summary(self) -> str:
        """One line for a person."""
        kept = self.samples - self.made
        resumed = f" ({kept} were there already)" if kept else ""
        again = f"; {self.outdated} were cleaned again: their pictures or files had changed" if self.outdated else ""
        return f"{self.root}: {self.samples} samples of split {self.split!r} cleaned{resumed}{again}"


def defend(
    dataset: str | Path,
    *,
    defense: str,
    out: str | Path,
    split: str | None = None,
    settings: Iterable[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> DefendReport:
    """Writes a dataset's pictures as a defense cleans them; takes up again what was begun, and cleans again what comes
    of pictures that are others now, or was damaged.

    The cleaned pictures have the relative paths of the dataset's. Beside them lie, for each split,
    `defense/<split>/masks/<index>_<camera>.png` (16 bits, 65535 is 1) and `defense/<split>/scores.json`, as far as the
    defense gives masks and scores.

    Args:
        dataset: root of a dataset of any task.
        defense: name of a defense plugin.
        out: folder for the pictures; may hold other splits of the same.
        split: of the dataset; may be left out where there is only one.
        settings: `KEY=VALUE` texts for the defense's options.
        seed: of the defense's own draws.
        progress: told after every sample.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    check_seed(seed)
    found = find("defense", defense)
    options = with_overrides(NO_OPTIONS, settings)
    config = read_node(found.spec.config, options, "")
    opened = open_dataset(dataset, split)
    spec = suitable(found, opened.plan.task["name"])
    root, name = Path(out), opened.plan.info.split
    refuse_dataset(root, "write the cleaned pictures into a folder of their own")
    plan: Json = {
        "defense": {"name": spec.name, "package": found.owner.package, "version": found.owner.version},
        "options": to_plain(config),
        "seed": seed,
        "dataset": opened.plan.content_key,
        "split": name,
    }
    begin(root, name, plan)
    guard = Guard(found, build(found, options))
    markers = {i: kept_marker(root, opened, i, spec) for i in range(len(opened))}
    missing = [i for i, marker in markers.items() if marker is None]
    outdated = sum(inside(root, marker_path(name, i)).exists() for i in missing)
    finished = len(opened) - len(missing)
    if progress is not None:
        progress(finished, len(opened))
    for index in missing:
        sample = opened[index]
        result = guard.apply(sample.images, derive_rng(seed, "defend", spec.name, index), index)
        markers[index] = write_sample(root, opened, index, sample, spec, result)
        finished += 1
        if progress is not None:
            progress(finished, len(opened))
    if "score" in spec.outputs:
        scores = [marker.score for marker in markers.values() if marker is not None]
        write_whole(root, f"{FOLDER}/{name}/scores.json", dump_json({"scores": scores}))
    clear_scratch(root)
    return DefendReport(root=root, split=name, samples=len(opened), made=len(missing), outdated=outdated)


def suitable(found: Found, task: str) -> DefenseSpec[Any]:
    """The defense's spec, if it can do this job, which has pictures alone.

    Raises:
        GearError: it is not made for the task, or needs a model or samples to learn from.
    """
    spec = found.spec
    assert isinstance(spec, DefenseSpec)
    if spec.tasks and task not in spec.tasks:
        raise GearError(f"defense {spec.name!r} is for {', '.join(spec.tasks)}; this is a {task} dataset")
    if spec.taps or spec.needs_model:
        raise GearError(f"defense {spec.name!r} looks into a model; cleaning pictures alone is not enough for it")
    if spec.needs_calibration:
        raise GearError(f"defense {spec.name!r} must learn from clean and patched samples first; gear defend has none")
    return spec


def begin(root: Path, split: str, plan: Json) -> None:
    """Writes what the run is made of, or checks that what is there was made of the same, as far as a sample was.

    Raises:
        DatasetError: it was made otherwise, or the disk refuses.
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
            root, f"split {split!r} was cleaned in another way ({', '.join(differs)} differ); use another --out"
        )


NUMBERS = (int, float, np.floating, np.integer)


class Guard:
    """A third party's defense, whose failures say whose they are."""

    def __init__(
        self,
        found: Found,
        defense: Defense,
        model: Model | None = None,
        learn: Callable[[], Any] = lambda: None,
    ) -> None:
        """Args:
        found: whose it is.
        defense: the thing itself.
        model: what it guards, for a defense that looks into it.
        learn: gives what its `fit` makes of calibration data; called once, before the first sample.
        """
        self._found, self._defense, self._model, self._learn = found, defense, model, learn

    @functools.cached_property
    def state(self) -> Any:
        """What the defense has learnt. Learning takes minutes, and what is finished needs none of it."""
        return self._learn()

    def apply(self, views: Mapping[str, UInt8Image], rng: np.random.Generator, index: int) -> DefenseResult:
        """Cleans one sample.

        Raises:
            PluginError: the defense fails, or returns something else than it promises.
        """
        for picture in views.values():
            picture.setflags(write=False)
        with blamed(self._found, f"apply on sample {index}"):
            result = self._defense.apply(views, self._model, self.state, rng)
        problem = self._problem(result, views)
        if problem:
            raise self._error(index, problem)
        # NumPy's numbers will do, but are no JSON.
        return result if result.score is None else dataclasses.replace(result, score=float(result.score))

    def _problem(self, result: Any, views: Mapping[str, UInt8Image]) -> str:
        """What is wrong with a result, or nothing."""
        if not isinstance(result, DefenseResult):
            return f"apply returns a DefenseResult, got {type(result).__name__}"
        sizes = {name: picture.shape[:2] for name, picture in views.items()}
        outputs = self._found.spec.outputs  # type: ignore[attr-defined]
        has_mask = "mask" in outputs or result.mask is not None  # what was not promised is used, too
        for name, size in sizes.items():
            if not _is_array(_of_camera(result.views, name), (*size, 3), np.uint8):
                return f"views[{name!r}] must have shape {(*size, 3)} of uint8"
            if not has_mask:
                continue
            mask = _of_camera(result.mask, name)
            if not _is_array(mask, size, np.float32):
                return f"mask[{name!r}] must have shape {size} of float32"
            if not (mask.min() >= 0 and mask.max() <= 1):  # NaN is neither
                return f"mask[{name!r}] must lie in 0..1, got {mask.min():g} to {mask.max():g}"
        if unknown := (result.mask or {}).keys() - sizes.keys():
            return f"mask[{min(unknown)!r}] is of no camera that it was shown"
        has_score = "score" in outputs or result.score is not None
        if has_score and not (isinstance(result.score, NUMBERS) and 0 <= result.score <= 1):
            return f"score must be a float in 0..1, got {result.score!r}"
        return ""

    def _error(self, index: int, problem: str) -> PluginError:
        owner = self._found.owner
        name = f"{self._found.spec.name} ({owner.package} {owner.version})"
        return PluginError(name, f"apply on sample {index}", problem)


def _of_camera(given: object, name: str) -> Any:
    """What a defense says of a camera; None where it does not say it by name."""
    return given.get(name) if isinstance(given, Mapping) else None


def _is_array(value: object, shape: tuple[int, ...], dtype: npt.DTypeLike) -> bool:
    return isinstance(value, np.ndarray) and value.shape == shape and value.dtype == dtype
