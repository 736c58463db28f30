"""Sidecars that were damaged, edited or written by others: one line that says where, and what to do."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.config.nodes import parse_text
from gear.contracts.tasks import SplitInfo
from gear.dataset.json_text import load_json
from gear.dataset.plan import Plan
from gear.dataset.sidecar import read_sidecar
from gear.dataset.store import Store
from gear.plugins.build import build_task
from gear.plugins.datasets import open_dataset
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import DatasetError
from gear.verbs.sheet import contact_sheet
from gear.view.write import write_view

REMEDY = "delete it and run the same collection again"
SIDECAR = "gear/test/samples/000000.json"

Edit = Callable[[Any], object]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The root of a dataset of one sample of a task."""
    roots: dict[str, Path] = {}

    def root(task: str) -> Path:
        if task not in roots:
            roots[task] = tmp_path_factory.mktemp(task)
            fill(roots[task], task).close(build_task(task, parse_text(json.dumps(OPTIONS), "options"))[1], {})
        return roots[task]

    return root


OPTIONS = {"width_px": 320, "height_px": 96}


def fill(root: Path, name: str) -> Store:
    _, task = build_task(name, parse_text(json.dumps(OPTIONS), "options"))
    info = SplitInfo(town="town10", scene="billboard01", split="test", seed=5, patch_label="none")
    plan = Plan(
        task={"name": name, "package": "mujoco-gear", "version": "0.1.0"},
        options=OPTIONS,
        content={"scene": "billboard01"},
        patch={"label": "none", "sha256": ""},
        info=info,
        samples=1,
    )
    store = Store(root, plan)
    store.open({})
    frame, record = synthetic_frame(task.rig(), index=0, seed=5)
    sample = task.ground_truth(frame, dataclasses.replace(record, split="test"))
    store.write(sample, task.encode(sample, info))
    return store


def put(*path: str | int, value: Any) -> Edit:
    """A change of one value."""

    def change(content: Any) -> None:
        for key in path[:-1]:
            content = content[key]
        content[path[-1]] = value

    return change


@pytest.fixture
def edited(made: Callable[[str], Path]) -> Any:
    """The root of a dataset with its sidecar changed, until the test is over."""
    originals: dict[Path, str] = {}

    def edit(task: str, change: Edit) -> Path:
        root = made(task)
        path = root / SIDECAR
        originals.setdefault(path, path.read_text())
        content = json.loads(originals[path])
        change(content)
        path.write_text(json.dumps(content))
        return root

    yield edit
    for path, text in originals.items():
        path.write_text(text)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (put("surfaces", 0, "corners_px", value=[]), r"surfaces\[0\].corners_px: expected 4 items, got 0"),
        (put("surfaces", 0, "image_from_unit", value=[1.0]), r"surfaces\[0\].image_from_unit: expected 9 items, got 1"),
        (put("surfaces", 0, "corners_px", 0, 1, value=1e300), r"surfaces\[0\].corners_px\[0\]\[1\]: is larger than 1e"),
        (put("surfaces", 0, "corners_px", 0, 1, value=10**300), "is larger than"),
        (put("surfaces", 0, "mask_rle", value=""), r"surfaces\[0\].mask_rle: fills 0 pixels, not 320 x 96"),
        (put("surfaces", 0, "mask_rle", value="☃"), r"surfaces\[0\].mask_rle: .*ascii"),
        (put("surfaces", 0, "camera", value="top"), r"surfaces\[0\].camera: is none of the record's"),
        (put("surfaces", 0, "visible_px", value=-1), r"surfaces\[0\]: cannot show -1 px"),
        (put("record", "cameras", 0, "width_px", value=0), r"record.cameras\[0\]: pictures are 1 to 8192 px"),
        (put("record", "cameras", 0, "focal_px", value=0), r"record.cameras\[0\]: the focal length must be above 0"),
        (put("record", "cameras", value=[]), "record.cameras: there is none"),
        (put("record", "actors", value=[]), "record.actors: there is no ego car"),
        (put("record", "actors", 0, "world_from_actor", "quat_wxyz", value=[0, 0, 0, 0]), "must have length 1"),
        (put("record", "surfaces", 0, "actor_id", value=999), r"record.surfaces\[0\].actor_id: there is no actor 999"),
        (put("record", "index", value=1), "record.index: is 1, the file's name says 0"),
        (put("record", "index", value="x" * 500), r"record.index: expected int, got 'x{30,60}\.\.\."),
        (lambda content: content["record"]["actors"].append(content["record"]["actors"][0]), "one is named twice"),
        (lambda content: content.pop("files"), "'files' is missing"),
    ],
)  # fmt: skip
def test_what_cannot_be_true_is_one_line(edited: Callable[..., Path], change: Edit, problem: str) -> None:
    root = edited("depth", change)
    with pytest.raises(DatasetError, match=problem) as caught:
        read_sidecar(root / SIDECAR)
    said = str(caught.value)
    assert said.startswith(str(root / SIDECAR)) and said.endswith(REMEDY) and "\n" not in said and len(said) < 400
    with pytest.raises(DatasetError):
        contact_sheet(root)


@pytest.mark.parametrize(
    ("task", "change", "problem"),
    [
        ("detect2d", put("facts", "objects", 0, "category_id", value=-1), r"objects\[0\].category_id: -1 is no categ"),
        ("detect2d", put("facts", "objects", 0, "box_px", 2, value=1e300), r"objects\[0\].box_px\[2\]: is larger than"),
        ("detect2d", put("facts", "objects", 0, "box_px", 2, value=-9), r"objects\[0\].box_px: ends before it begins"),
        ("detect2d", put("facts", "objects", 0, "rle", value=""), r"objects\[0\].rle: run lengths fill 0 pixels"),
        ("stereo3d", put("facts", "objects", 0, "box", "height_m", value=-1e300), r"objects\[0\].box.height_m: is lar"),
        ("stereo3d", put("facts", "baseline_m", value=0), "facts.baseline_m: is 0 m"),
    ],
)  # fmt: skip
def test_absurd_objects_are_one_line(
    tmp_path: Path, edited: Callable[..., Path], task: str, change: Edit, problem: str
) -> None:
    root = edited(task, change)
    for read in (lambda: open_dataset(root)[0], lambda: contact_sheet(root)):
        with pytest.raises(DatasetError, match=re.escape(str(root / SIDECAR)) + f".*{problem}.*{REMEDY}$"):
            read()
    assert re.search(problem, write_view(root, tmp_path / "view.html").summary())


def test_a_box_far_outside_is_drawn_in_no_time(edited: Callable[..., Path]) -> None:
    """Dashes to a billion pixels took minutes."""

    def far(content: Any) -> None:
        content["facts"]["objects"][0] |= {"box_px": [-1e9, 0, 1e9, 1e9], "is_ignored": True}

    contact_sheet(edited("stereo3d", far))


def test_the_split_is_not_closed_with_a_sidecar_that_its_task_cannot_read(tmp_path: Path) -> None:
    store = fill(tmp_path, "detect2d")
    _, task = build_task("detect2d", parse_text(json.dumps(OPTIONS), "options"))
    path = tmp_path / SIDECAR
    whole = path.read_text()
    for change, problem in (
        (put("facts", "objects", 0, "category_id", value=-1), r"facts.objects\[0\].category_id: -1 is no category"),
        (put("record", "cameras", 0, "name", value="top"), r"surfaces\[0\].camera: is none of the record's"),
    ):
        content = json.loads(whole)
        change(content)
        path.write_text(json.dumps(content))
        with pytest.raises(DatasetError, match=re.escape(str(path)) + f".*{problem}.*{REMEDY}$"):
            store.close(task, {})
    assert not (tmp_path / "gear/test/manifest.json").exists()


@pytest.mark.parametrize(
    "text", ["[1e999]", "[-1e999]", "[NaN]", "[" + "9" * 400 + "]", r'["\udc80"]', '["\\uD800 x"]']
)
def test_what_gear_never_writes_is_no_json(tmp_path: Path, text: str) -> None:
    """Numbers that become infinite, and half characters: OpenCV dies of one that it is to draw."""
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(DatasetError, match="is not JSON"):
        load_json(path)


def test_whole_characters_beyond_the_basic_plane_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(r'["\ud83d\ude97"]')
    assert load_json(tmp_path / "a.json") == ["🚗"]


def test_a_plan_that_does_not_say_what_is_asked_is_one_line(made: Callable[[str], Path]) -> None:
    dataset = open_dataset(made("depth"))
    assert dataset.content(str, "scene") == "billboard01"
    for kind, keys in ((int, ("scene",)), (int, ("frames",)), (str, ("scene", "name"))):
        with pytest.raises(
            DatasetError, match=r"plan\.json: is not of this version of gear \(content\..*; collect the"
        ):
            dataset.content(kind, *keys)
