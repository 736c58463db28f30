"""`gear defend` on a tiny dataset: what it writes, what it refuses, and that it can be taken up again."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.cli.main import main
from gear.contracts.defenses import DefenseResult
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.jpeg import Jpeg, JpegConfig
from gear.values.errors import ConfigError, DatasetError, GearError, PluginError, UnknownNameError
from gear.verbs.defend.run import defend
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy, put_package


@pytest.fixture
def stereo(tmp_path: Path, copy_small: Copy) -> Path:
    copy_small("stereo3d", tmp_path / "data", patch="random")
    return tmp_path / "data"


@dataclass(frozen=True, kw_only=True)
class Config:
    radius_px: int = 2


class Odd:
    """Its answer is whatever it was made with."""

    def __init__(self, answer: Callable[..., Any]) -> None:
        self.answer = answer

    def apply(self, views: Any, model: Any, state: Any, rng: np.random.Generator) -> Any:
        return self.answer(views)


@pytest.fixture
def stranger(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def install(answer: Callable[..., Any], **facts: Any) -> None:
        spec = DefenseSpec(name="odd", summary="Odd.", config=Config, build=lambda _: Odd(answer), **facts)  # type: ignore[arg-type]
        put_package(monkeypatch, [spec])

    return install


def test_pictures_keep_their_paths_and_are_what_the_defense_makes(stereo: Path, tmp_path: Path) -> None:
    report = defend(stereo, defense="jpeg", out=tmp_path / "clean", settings=["quality=20"])
    assert (report.samples, report.made) == (2, 2)
    dataset = gear.open_dataset(stereo)
    written = [p for p in tree(tmp_path / "clean") if not p.startswith("defense/")]
    assert sorted(written) == sorted(
        p for i in range(2) for p in dataset.sidecar(i).files if "image_2" in p or "image_3" in p
    )
    assert len(written) == 4
    jpeg = Jpeg(JpegConfig(quality=20))
    for path in written:
        before = cv2.imread(str(stereo / path))[..., ::-1]
        after = cv2.imread(str(tmp_path / "clean" / path))[..., ::-1]
        assert np.array_equal(after, jpeg.clean(np.ascontiguousarray(before))[0])
        assert not np.array_equal(after, before)
    assert not list((tmp_path / "clean").rglob("*mask*")) and not list((tmp_path / "clean").rglob("scores.json"))


def test_masks_and_scores_are_written(tmp_path: Path, copy_small: Copy) -> None:
    copy_small("semseg", tmp_path / "data", patch="random")
    assert main(["defend", str(tmp_path / "data"), "--defense", "lgs", "--out", str(tmp_path / "clean")]) == 0
    folder = tmp_path / "clean" / "defense" / "debug"
    scores = json.loads((folder / "scores.json").read_text())["scores"]
    assert len(scores) == 2 and all(0 <= score <= 1 for score in scores)
    for index, score in enumerate(scores):
        mask = cv2.imread(str(folder / f"masks/{index:06d}_left.png"), cv2.IMREAD_UNCHANGED)
        assert mask.dtype == np.uint16 and mask.shape == (160, 320)
        assert float(mask.mean()) / 65535 == pytest.approx(score, abs=1e-4)


def test_it_is_taken_up_again_and_gives_the_same(stereo: Path, tmp_path: Path) -> None:
    def stop(finished: int, total: int) -> None:
        if finished == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        defend(stereo, defense="lgs", out=tmp_path / "clean", on_progress=stop)
    assert not (tmp_path / "clean/defense/debug/scores.json").exists()
    assert defend(stereo, defense="lgs", out=tmp_path / "clean").made == 1
    defend(stereo, defense="lgs", out=tmp_path / "whole")
    assert tree(tmp_path / "clean") == tree(tmp_path / "whole")
    assert defend(stereo, defense="lgs", out=tmp_path / "clean").made == 0
    with pytest.raises(DatasetError, match=r"cleaned with other settings \(options differ\)"):
        defend(stereo, defense="lgs", out=tmp_path / "clean", settings=["strength=1.5"])
    folder = tmp_path / "clean/defense/debug"
    (folder / "plan.json").write_text("{")
    with pytest.raises(DatasetError, match=r"plan.json: is not JSON .*; use another --out, or delete this folder$"):
        defend(stereo, defense="lgs", out=tmp_path / "clean")


def test_pictures_that_do_not_fit_the_disk_are_refused(
    stereo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(GearError, match=r"1 more cleaned sample will need about .* kB, and 1 kB are free there"):
        defend(stereo, defense="jpeg", out=tmp_path / "clean")


def test_bad_input_is_refused_before_anything_is_written(stereo: Path, tmp_path: Path) -> None:
    before = tree(stereo)
    with pytest.raises(UnknownNameError, match="did you mean median"):
        defend(stereo, defense="medain", out=tmp_path / "x")
    with pytest.raises(ConfigError, match="did you mean 'quality'"):
        defend(stereo, defense="jpeg", out=tmp_path / "x", settings=["qualty=3"])
    with pytest.raises(DatasetError, match="is a dataset"):
        defend(stereo, defense="jpeg", out=stereo)
    with pytest.raises(GearError):
        defend(tmp_path / "nowhere", defense="jpeg", out=tmp_path / "x")
    assert not (tmp_path / "x").exists() and tree(stereo) == before


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"tasks": ("depth",)}, "is for depth; this is a stereo3d dataset"),
        ({"taps": ("layer1",)}, "looks into a model"),
        ({"needs_model": True}, "looks into a model"),
        ({"needs_calibration": True}, "must learn"),
    ],
)
def test_capabilities_are_checked_first(
    stereo: Path, tmp_path: Path, stranger: Callable[..., None], facts: dict[str, Any], message: str
) -> None:
    stranger(lambda views: DefenseResult(views=views), **facts)
    with pytest.raises(GearError, match=message):
        defend(stereo, defense="odd", out=tmp_path / "x")
    assert not (tmp_path / "x").exists()


def raises(views: Any) -> Any:
    raise RuntimeError("boom")


MASK = {"outputs": frozenset({"images", "mask"})}


def masked(views: Any, value: float = 0.0, *, by_name: bool = True) -> DefenseResult:
    """The pictures as they came, with one value as the mask of each, or of the first alone without its name."""
    masks = {name: np.full(picture.shape[:2], value, np.float32) for name, picture in views.items()}
    return DefenseResult(views=views, mask=masks if by_name else next(iter(masks.values())))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("answer", "facts", "message"),
    [
        (raises, {}, "RuntimeError: boom"),
        (lambda views: sys.exit(3), {}, "SystemExit: 3"),
        (lambda views: views, {}, "returns a DefenseResult, got dict"),
        (lambda views: DefenseResult(views={}), {}, r"views\['left'\] must have shape"),
        (lambda views: DefenseResult(views={k: v / 2 for k, v in views.items()}), {}, "uint8"),
        (lambda views: DefenseResult(views=views), {"outputs": frozenset({"images", "mask"})}, r"mask\['left'\]"),
        (lambda views: DefenseResult(views=views, score=7.0), {"outputs": frozenset({"score"})}, r"score .* got 7\.0"),
        (lambda views: DefenseResult(views=list(views.values())), {}, r"views\['left'\] must have shape"),  # type: ignore[arg-type]
        (lambda views: DefenseResult(views=views, score=7.0), {}, r"score .* got 7\.0"),
        (lambda views: masked(views, 255), {}, r"mask\['left'\] must lie in 0\.\.1"),
        (lambda views: masked({**views, "rear": views["left"]}), MASK, r"mask\['rear'\] is of no camera"),
        (lambda views: masked(views, by_name=False), MASK, r"mask\['left'\] must have shape"),
        (lambda views: masked(views, 255), MASK, r"mask\['left'\] must lie in 0\.\.1, got 255 to 255"),
        (lambda views: masked(views, np.nan), MASK, r"mask\['left'\] must lie in 0\.\.1, got nan to nan"),
    ],
)
def test_a_defense_that_breaks_is_named(
    stereo: Path, tmp_path: Path, stranger: Callable[..., None], answer: Any, facts: dict[str, Any], message: str
) -> None:
    stranger(answer, **facts)
    for seed in (0, 1):  # the first try made nothing that the second could be mixed with
        with pytest.raises(
            PluginError, match=rf"plugin odd \(odd_package \?\) failed at apply on sample 0: .*{message}"
        ):
            defend(stereo, defense="odd", out=tmp_path / "x", seed=seed)


def test_a_score_may_be_a_number_of_numpys(stereo: Path, tmp_path: Path, stranger: Callable[..., None]) -> None:
    stranger(lambda views: DefenseResult(views=views, score=np.float32(0.5)), outputs=frozenset({"images", "score"}))
    defend(stereo, defense="odd", out=tmp_path / "x")
    (scores,) = (json.loads(path.read_text())["scores"] for path in (tmp_path / "x").rglob("scores.json"))
    assert set(scores) == {0.5}


def test_what_a_defense_prints_stays_off_stdout(
    stereo: Path, tmp_path: Path, stranger: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    def talks(views: Any) -> DefenseResult:
        print("hello")
        return DefenseResult(views=views)

    stranger(talks)
    assert main(["defend", str(stereo), "--defense", "odd", "--out", str(tmp_path / "x")]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'x'}: 2 samples of split 'debug' cleaned\n"
