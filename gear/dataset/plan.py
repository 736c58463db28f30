"""The plan of a split: everything that decides its bytes. One split never contains samples of two plans."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path

from gear.config.collection import SPLIT_NAME
from gear.contracts.tasks import SplitInfo
from gear.dataset.files import inside, write_whole
from gear.dataset.layout import GEAR, manifest_path, plan_path
from gear.dataset.sealed_json import REPAIR, DamagedError, load_sealed, sealed_json
from gear.values.errors import DatasetError, FieldError, OutdatedError, ReplaceableError
from gear.values.serial import Json, from_json, to_json


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Everything that decides the bytes of a split, as JSON.

    Attributes:
        task: name, package and version of the task plugin.
        options: options of the task.
        content: town, scene, weather, renderer and everything else that decides the pictures, without paths and patch.
        patch: label and sha256 of the patch's pictures.
        info: names and seed for the format's index files.
        samples: number of frames of the split.
        auxiliary: kinds of additional files of each sample (`probes`, `scans`, `flow`), which do not change pictures
            and labels.
        recipe: the collection's config without paths, from which damaged files can be made again; None in datasets of
            earlier versions.
        key_points: hash of the key points of all actors (`key_points_digest`), which labels can contain and no picture
            shows; "" if no actor has any.
    """

    task: dict[str, str]
    options: Json
    content: Json
    patch: dict[str, str]
    info: SplitInfo
    samples: int
    auxiliary: tuple[str, ...] = ()
    recipe: Json = None
    key_points: str = ""

    @property
    def twin_key(self) -> str:
        """A hash that is equal for two splits (twins) that differ only in the patch, in the number of samples and in
        key points.
        """
        return _digest({"task": self.task, "options": self.options, "content": self.content})

    @property
    def content_key(self) -> str:
        """A hash that is equal for two splits that differ only in the number of samples; samples of equal index
        have equal bytes.
        """
        content = {"twin": self.twin_key, "patch": self.patch}
        content |= {"auxiliary": list(self.auxiliary)} if self.auxiliary else {}
        return _digest(content | ({"key_points": self.key_points} if self.key_points else {}))

    @property
    def frames_per_sequence(self) -> int:
        """The number of samples of each driving sequence; 1 if every sample is a single picture."""
        frames = self.content.get("frames", 1) if isinstance(self.content, dict) else 1
        return frames if isinstance(frames, int) and frames > 0 else 1

    def as_json(self) -> Json:
        """The content of the plan's file; `auxiliary`, `recipe` and `key_points` are left out if they are empty."""
        content = to_json(self)
        for name in ("auxiliary", "recipe", "key_points"):
            if not getattr(self, name):
                del content[name]
        return content


def manifest_facts(plan: Plan) -> dict[str, Json]:
    """The metadata of a split for its manifest, with the keys `task`, `options`, `info`, `seed`, `patch`, `renderer`,
    `versions`, `scene`, `weather`, `assets` and `config`.

    Raises:
        DatasetError: the plan lacks an entry, because it was edited.
    """
    try:
        return {
            "task": dict(plan.task),
            "options": plan.options,
            "info": to_json(plan.info),
            "seed": plan.content["seed"],
            "patch": dict(plan.patch),
            "renderer": plan.content["renderer"],
            "versions": plan.content["versions"],
            "scene": plan.content["scene"],
            "weather": plan.content["weather"],
            "assets": plan.content["assets"],
            "config": plan.recipe,
        }
    except (KeyError, TypeError) as error:
        problem = f"is not of this version of gear (content: {error}); collect the split again"
        raise DatasetError(plan_path(plan.info.split), problem) from error


def _digest(value: Json) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def refuse_copy(root: Path, split: str) -> None:
    """Refuses a split whose folder was copied or renamed.

    The plan and the sidecars of such a split name the files of the original split.

    Args:
        root: folder of the dataset.
        split: name of the split, which is also the name of its folder below `gear/`. A missing or damaged plan is not
            refused.

    Raises:
        DatasetError: the plan is that of another split.
    """
    try:
        there = load_sealed(inside(root, plan_path(split)))
    except DatasetError:  # missing or damaged
        return
    _refuse_copy(root, split, there)


def _refuse_copy(root: Path, split: str, there: Json) -> None:
    info = there.get("info") if isinstance(there, dict) else None
    name = info.get("split") if isinstance(info, dict) else None
    if isinstance(name, str) and name != split:
        remedy = f"a split cannot be copied or renamed; delete {GEAR}/{split}, or name it {GEAR}/{name} again"
        raise DatasetError(root, f"{plan_path(split)}: is the plan of split {name!r}; {remedy}")


def read_plan(root: Path, split: str) -> Plan | None:
    """Reads the plan of a split (everything that decides its bytes); None if there is no such split.

    Args:
        root: folder of the dataset.
        split: name of the split.

    Raises:
        ReplaceableError: the plan was written by another version of gear.
        DamagedError: the bytes of the plan are not those that gear wrote.
        DatasetError: the plan cannot be read, or is that of another split.
    """
    path = inside(root, plan_path(split))
    if not path.exists():
        return None
    try:
        content = load_sealed(path)
    except DamagedError as error:
        raise _damaged(root, split, error.problem.partition(";")[0]) from error
    _refuse_copy(root, split, content)
    try:
        plan: Plan = from_json(Plan, content, "plan")
        for field, key in (("task", "name"), ("patch", "label")):
            if not isinstance(there := getattr(plan, field), dict) or key not in there:
                raise FieldError(f"plan.{field}", f"must have a {key}")
        if not SPLIT_NAME.fullmatch(plan.info.split):
            raise FieldError("plan.info.split", f"{plan.info.split!r} is not a split's name")
        if plan.samples < 1:
            raise FieldError("plan.samples", f"must be at least 1, got {plan.samples}")
        return plan
    except FieldError as error:
        if _manifest(root, split).get("versions", {}).get("gear") == version("mujoco-gear"):
            raise _damaged(root, split, f"is damaged ({error})") from error
        problem = f"{plan_path(split)}: is not of this version of gear ({error})"
        raise ReplaceableError(root, problem, split=split) from error


def _manifest(root: Path, split: str) -> dict[str, Json]:
    """The manifest of a split; empty if it is missing or damaged."""
    try:
        there = load_sealed(inside(root, manifest_path(split)))
    except DatasetError:
        return {}
    return there if isinstance(there, dict) else {}


def _damaged(root: Path, split: str, problem: str) -> DamagedError:
    """The error for a damaged plan. It advises a repair if the split has a manifest, from which the plan can be made
    again.
    """
    remedy = REPAIR if _manifest(root, split) else "delete it and run the same collection again; samples are kept"
    return DamagedError(root / plan_path(split), f"{problem}; {remedy}")


def refuse_other_tasks(root: Path, plan: Plan, *, besides: str = "") -> None:
    """Checks that all splits of a dataset have the same task as a new split.

    Args:
        root: root of the dataset.
        plan: plan of the new split.
        besides: name of a split that is not checked.

    Raises:
        DatasetError: the root holds another task's dataset, or a plan in it cannot be read.
    """
    for path in sorted((root / GEAR).glob("*/plan.json")):
        other = None if path.parent.name == besides else read_plan(root, path.parent.name)
        if other is not None and other.task["name"] != plan.task["name"]:
            raise DatasetError(
                root, f"holds a {other.task['name']} dataset, {plan.task['name']} was asked for; use another --out"
            )


def begin(root: Path, plan: Plan) -> None:
    """Writes the plan of a new split (everything that decides its bytes), or checks that an existing split can be
    continued.

    An existing split can be continued if its plan is equal and has at most as many samples.

    Args:
        root: folder of the dataset.
        plan: plan of the split.

    Raises:
        OutdatedError: the existing split differs only in its patch.
        ReplaceableError: the existing split has another configuration, or more samples.
        DatasetError: the root holds another task's dataset, or a plan in it cannot be read.
    """
    split = plan.info.split
    refuse_other_tasks(root, plan)
    there = read_plan(root, split)
    if there is not None and there.content_key != plan.content_key:
        if _manifest(root, split).get("content_key") == plan.content_key:
            raise _damaged(root, split, "is damaged: the manifest is of another plan, the one that is collected now")
        what = ", ".join(differences(there.as_json(), plan.as_json())[:4])
        is_same_otherwise = (there.twin_key, there.auxiliary, there.key_points) == (
            plan.twin_key,
            plan.auxiliary,
            plan.key_points,
        )
        raise (OutdatedError if is_same_otherwise else ReplaceableError)(
            root, f"split {split!r} was made with another configuration ({what})"
        )
    if there is not None and there.samples > plan.samples:
        raise ReplaceableError(
            root, f"split {split!r} was begun with {there.samples} samples, {plan.samples} were asked for"
        )
    if there is None or there.as_json() != plan.as_json():
        write_plan(root, plan)


def write_plan(root: Path, plan: Plan) -> None:
    """Writes the plan of a split (everything that decides its bytes) as JSON with a hash of its own content.

    Args:
        root: folder of the dataset.
        plan: the plan; it names its split.

    Raises:
        DatasetError: the file cannot be written.
    """
    write_whole(root, plan_path(plan.info.split), sealed_json(plan.as_json()))


def differences(old: Json, new: Json, key: str = "", *, places: tuple[str, str] = ("there", "now")) -> list[str]:
    """Lists the differences of two JSON values: one text per key, with both values.

    Args:
        old, new: the values; at the top level the keys `samples`, `info` and `recipe` are left out.
        key: key path of the two values in the objects that contain them; empty for the top level.
        places: words that name the origin of the old and of the new value in the texts.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        found: list[str] = []
        for name in sorted(old.keys() | new.keys()):
            if name in ("samples", "info", "recipe") and not key:
                continue
            inner = f"{key}.{name}" if key else name
            found += differences(old.get(name), new.get(name), inner, places=places)
        return found
    if isinstance(old, list) and isinstance(new, list):
        return [
            difference
            for place, (before, after) in enumerate(zip_longest(old, new))
            for difference in differences(before, after, f"{key}[{place}]", places=places)
        ]
    return [] if old == new else [f"{key}: {_short(old)} {places[0]}, {_short(new)} {places[1]}"]


def _short(value: Json) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."
