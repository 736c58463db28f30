"""`gear attack` without gradients: what is counted, how long it takes, and what a kill costs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.attacks import Budget, Patch
from gear.contracts.specs import AttackSpec, DefenseSpec
from gear.plugins.defenses.per_picture import PerPicture
from gear.testing.compare import difference
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.attack.monitor import Recorder
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Nothing, Small


def test_too_few_queries_are_said(small: Small, install: Install, tmp_path: Path) -> None:
    with pytest.raises(GearError, match="1 queries are too few for one step"):
        attack(small(), model="tiny_segmenter", out=tmp_path, attack="nes", queries=1, settings=SMALL[:2])


class Unwatched:
    """Asks as often as it may, and pays `monitor` no attention."""

    def __init__(self, config: Nothing) -> None:
        pass

    def optimise(self, model: Any, dataset: Any, compositor: Any, *, budget: Budget, **rest: Any) -> Any:
        grey = torch.full((3, 4, 8), 0.5)
        for _ in range(budget.queries or 0):
            with torch.no_grad():
                model.forward({"left": compositor.compose([grey], [0], "left")})
        return (Patch(name="patch_0", rgb=np.full((4, 8, 3), 0.5, np.float32)),)


def test_who_counts_queries_need_not_be_watched(small: Small, install: Install, tmp_path: Path) -> None:
    spec = AttackSpec(name="unwatched", summary="x.", config=Nothing, build=Unwatched, needs_gradients=False)
    install(tiny_segmenter, spec)
    assert attack(small(), model="tiny_segmenter", out=tmp_path, attack="unwatched", queries=3).made


class Curveless(Unwatched):
    """Has nothing to draw a curve of."""

    def optimise(self, *asked: Any, monitor: Any, **rest: Any) -> Any:
        patches = super().optimise(*asked, **rest)
        assert monitor.resume() is None
        for done in (1, 2):
            assert not monitor.step(done, {}, lambda: patches, dict)
        return patches


def test_steps_need_no_metrics(small: Small, install: Install, tmp_path: Path) -> None:
    spec = AttackSpec(name="curveless", summary="x.", config=Nothing, build=Curveless, needs_gradients=False)
    install(tiny_segmenter, spec)
    report = attack(
        small(), model="tiny_segmenter", out=tmp_path, attack="curveless", queries=3, val=small(split="val")
    )
    assert report.facts["steps_done"] == 2 and report.facts["curves"] == {}
    assert [step for step, _ in report.facts["validation_harm"]] == [2]


def test_queries_that_end_between_two_looks_are_judged_too(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(
        small(), model="tiny_segmenter", val=small(split="val"), out=tmp_path, attack="square", queries=7, every=50,
        settings=SMALL[:2],
    )  # fmt: skip
    (judged,) = report.facts["validation_harm"]
    assert judged[0] == report.facts["steps_done"] < 50


def test_queries_alone_decide_how_long_it_takes(small: Small, install: Install, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    report = attack(
        small(), model="tiny_segmenter", out=tmp_path / "a", attack="square", queries=401, settings=SMALL[:2],
        on_progress=lambda *done: seen.append(done),
    )  # fmt: skip
    assert 301 < report.facts["steps_done"] < 401 and report.facts["curves"]["queries_left"][-1] == 0
    assert seen[0] == (0, 401) and seen[-1] == (401, 401), "progress counts queries"
    capped = attack(
        small(), model="tiny_segmenter", out=tmp_path / "b", attack="nes", queries=401, steps=2, settings=SMALL[:2]
    )
    assert capped.facts["steps_done"] == 2
    with pytest.raises(GearError, match="takes steps; --queries is for"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "c", queries=10)


@pytest.mark.parametrize("name", ["square", "nes"])
def test_a_killed_search_pays_no_query_twice(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Depth costs one query more for every sample seen for the first time, also when it goes on."""
    settings = [*SMALL[:2], "pairs=2"] if name == "nes" else SMALL[:2]
    facts: dict[str, Any] = {"model": "tiny_depth", "attack": name, "queries": 40, "settings": settings}
    whole = attack(small("depth"), out=tmp_path / "whole", **facts)
    monkeypatch.setattr("gear.verbs.attack.monitor.SECONDS_BETWEEN", 0.0)

    def killed(done: int, total: int) -> None:
        if done > 15:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attack(small("depth"), out=tmp_path / "cut", **facts, on_progress=killed)
    resumed = attack(small("depth"), out=tmp_path / "cut", **facts)
    assert resumed.facts["curves"] == whole.facts["curves"]
    assert not difference(resumed.patches, whole.patches, "patches")


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        ("nes", {"grid": np.zeros((1, 3, 1, 1), np.float32)}, r"patches of \(1, 3, 1, 1\), not \(1, 3, 2, 3\)"),
        ("nes", {"paid": np.zeros(1, np.float32)}, "its 'paid' is no int64"),
        ("nes", {"done": None}, "it lacks done"),
        ("square", {"textures": np.zeros((1, 3, 12, 1), np.float32)}, r"patches of \(1, 3, 12, 1\), not"),
        ("square", {"left": np.zeros(2, np.int64)}, "its 'left' is no int64"),
        ("square", {"best": np.array(np.nan)}, "its 'best' is no float64"),
    ],
)
def test_a_damaged_search_is_refused(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, damage: Any, said: str
) -> None:
    facts: dict[str, Any] = {"model": "tiny_segmenter", "attack": name, "queries": 40, "settings": SMALL[:2]}
    whole: list[dict[str, Any]] = []
    monkeypatch.setattr(Recorder, "save", lambda self, done, state: whole.append(dict(state)))
    monkeypatch.setattr("gear.verbs.attack.monitor.SECONDS_BETWEEN", 0.0)
    attack(small(), out=tmp_path / "whole", **facts)
    damaged = {key: value for key, value in (whole[0] | damage).items() if value is not None}

    def resumed(self: Recorder) -> Any:
        return damaged

    monkeypatch.setattr(Recorder, "resume", resumed)
    with pytest.raises(GearError, match=f"{said}.*start it afresh$"):
        attack(small(), out=tmp_path / "cut", **facts)


class Hard(PerPicture):
    """A defense without gradients: what is bright turns black."""

    def __init__(self, config: Nothing) -> None:
        pass

    def clean(self, picture: Any) -> Any:
        return np.where(picture > 140, 0, picture).astype(np.uint8), None

    def clean_tensor(self, pictures: torch.Tensor) -> torch.Tensor:
        raise ValueError("has no gradient")


def test_a_defense_without_gradients_is_looked_through_by_what_needs_none(
    small: Small, install: Install, tmp_path: Path
) -> None:
    hard = DefenseSpec(name="hard", summary="Blackens.", config=Nothing, build=Hard, gradient="none")
    install(tiny_segmenter, hard)
    facts: dict[str, Any] = {"model": "tiny_segmenter", "attack": "square", "queries": 12, "settings": SMALL[:2]}
    plain = attack(small(), out=tmp_path / "plain", **facts)
    aware = attack(small(), out=tmp_path / "aware", defense="hard", **facts)
    assert aware.facts["defense"]["name"] == "hard" and aware.facts["queries"] == plain.facts["queries"]
    assert aware.facts["gradient_check"] is None, "there is no gradient to promise anything"
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)
    with pytest.raises(GearError, match=r"'hard' declares no gradient.*--attack square"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "white", steps=2, settings=SMALL[:2], defense="hard")
