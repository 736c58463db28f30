"""Fixtures of the page's tests."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.dataset.reading import Dataset
from gear.plugins.build import find
from gear.plugins.datasets import open_dataset
from gear.values.serial import to_json
from tests.verbs.conftest import put_package
from tests.verbs.evaluate.conftest import Oracle, model_spec

from .browser import Browser, find_chromium
from .drive_studies import make_study
from .view_datasets import OPTIONS, store_samples

Write = Callable[..., Path]


@pytest.fixture
def write_dataset(tmp_path: Path) -> Write:
    """`write_dataset("semseg", 3)` gives the root of a finished split."""

    def write(name: str, count: int = 3, **settings: Any) -> Path:
        spec = find("task", name).spec
        config = spec.config(**OPTIONS[name])
        root = tmp_path / name
        store_samples(root, name, spec.build(config), to_json(config), count, **settings)
        return root

    return write


@pytest.fixture
def opened(write_dataset: Write) -> Callable[..., Dataset[Any]]:
    """The same, opened."""
    return lambda name, count=3, **settings: open_dataset(write_dataset(name, count, **settings))


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = find_chromium()
    if program is None:
        reason = "no chromium on the PATH (Debian: apt-get install chromium); the page is not tested in a browser"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    opened = Browser(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def drive_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small study of `gear drive`; tests that change it copy it."""
    pytest.importorskip("av")
    return make_study(tmp_path_factory.mktemp("drives") / "study")


@dataclass(frozen=True, slots=True)
class Twins:
    """Four pictures of people and cars, twice: without a patch and with one; and evaluations of both.

    Attributes:
        none, patched: roots of the datasets.
        evaluation: a network that finds every object, but on the patched pictures none but the last.
        defended: the same network behind a defense.
    """

    none: Path
    patched: Path
    evaluation: Path
    defended: Path


@pytest.fixture(scope="session")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Twins:
    root = tmp_path_factory.mktemp("twins")
    spec = find("task", "detect2d").spec
    config = spec.config(**OPTIONS["detect2d"])
    roots = [root / "none", root / "odd-patch"]
    for place, patch in zip(roots, ("none", "odd"), strict=True):
        store_samples(place, "detect2d", spec.build(config), to_json(config), 4, patch=patch)
    clean = [one.images["left"].tobytes() for one in gear.open_dataset(roots[0])]

    def fooled(sample: Any, prediction: Any) -> Any:
        return prediction if sample.images["left"].tobytes() in clean else prediction[-1:]

    with pytest.MonkeyPatch.context() as patching:
        put_package(patching, [model_spec(lambda _: Oracle(roots, fooled), "detect2d")])
        gear.evaluate(roots, model="odd", out=root / "evaluation")
        put_package(patching, [model_spec(lambda _: Blind(), "detect2d")])
        patching.setattr("gear.measuring.scoring.DEFENDED_WIDTH_PX", 200)  # half of a picture's width
        gear.evaluate(roots, model="odd", defense="jpeg", defense_settings=["quality=5"], out=root / "defended")
    return Twins(none=roots[0], patched=roots[1], evaluation=root / "evaluation", defended=root / "defended")


class Blind:
    """A network that finds nothing."""

    def predict(self, views: Any) -> Any:
        return ()

    def taps(self) -> Any:
        return {}
