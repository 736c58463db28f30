from __future__ import annotations

import base64
import dataclasses
import json
import re
import zlib
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gear.cli.main import COMMANDS, main
from gear.dataset.reading import Dataset
from gear.values.errors import DatasetError
from gear.view.document import SCRIPTS, asset, policy, script
from gear.view.drive_page import SCRIPTS as DRIVE_SCRIPTS
from gear.view.sources import base_url
from gear.view.write import write_page, write_view

TASKS = ("semseg", "detect2d", "stereo3d", "depth")


class Blocks(HTMLParser):
    """Script blocks by id, and every tag."""

    def __init__(self, page: Path) -> None:
        super().__init__(convert_charrefs=True)
        self.blocks: dict[str, str] = {}
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._open: str | None = None
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._open = (dict(attrs).get("id") or "code") if tag == "script" else tag

    def handle_endtag(self, tag: str) -> None:
        self._open = None

    def handle_data(self, data: str) -> None:
        if self._open:
            self.blocks[self._open] = self.blocks.get(self._open, "") + data

    @property
    def index(self) -> Any:
        return json.loads(self.blocks["index"])

    def picture(self, sample: int, place: int) -> np.ndarray:
        data = np.frombuffer(base64.b64decode(self.blocks[f"p{sample}.{place}"]), np.uint8)
        return cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1]

    def detail(self, sample: int) -> Any:
        return json.loads(zlib.decompress(base64.b64decode(self.blocks[f"d{sample}"])))


@pytest.mark.parametrize("task", TASKS)
def test_every_sample_is_there_with_every_picture(task: str, write_dataset: Any, tmp_path: Path) -> None:
    from gear.plugins.datasets import open_dataset

    root = write_dataset(task, 2)
    report = write_view(root, tmp_path / "page.html")
    assert (report.samples, report.scale, report.problems) == (2, 1.0, ())
    assert report.size_bytes == (tmp_path / "page.html").stat().st_size
    page, dataset = Blocks(tmp_path / "page.html"), open_dataset(root)
    channels = [(channel["kind"], channel["name"]) for channel in page.index["channels"]]
    for number, sample in enumerate(dataset):
        wanted = {("image", k): v for k, v in sample.images.items()}
        wanted |= {("preview", k): v for k, v in dataset.task.preview(sample).items()}
        assert set(channels) == set(wanted)
        for place, channel in enumerate(channels):
            difference = page.picture(number, place).astype(int) - wanted[channel]
            assert np.abs(difference).mean() < 12, channel
            assert np.abs(page.picture(number, place)[:, ::-1].astype(int) - wanted[channel]).mean() > 12, "mirrored"
        detail, sidecar = page.detail(number), dataset.sidecar(number)
        assert detail["facts"] == sidecar.facts
        assert detail["record"]["index"] == number
        assert [file[0] for file in detail["files"]] == list(sidecar.files)
        seen = page.index["samples"][number]["surfaces"]
        assert [s["visible"] for s in seen] == [round(s.visible_fraction, 4) for s in sample.surfaces]


def test_the_same_dataset_gives_the_same_page(write_dataset: Any, tmp_path: Path) -> None:
    root = write_dataset("stereo3d", 3)
    for name in ("a.html", "b.html"):
        write_view(root, tmp_path / name)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_the_page_asks_for_nothing_from_elsewhere(write_dataset: Any, tmp_path: Path) -> None:
    write_view(write_dataset("depth", 1), tmp_path / "page.html")
    page = Blocks(tmp_path / "page.html")
    links = [
        value for _, attrs in page.tags for key, value in attrs.items() if key in ("src", "href", "action", "data")
    ]
    assert set(links) == {"data:,", "#main", "#/samples", "#/map", "#/statistics"}
    rules = next(attrs["content"] for _, attrs in page.tags if attrs.get("http-equiv") == "Content-Security-Policy")
    assert rules == policy(page.blocks["style"], page.blocks["code"])
    assert "unsafe" not in str(rules) and str(rules).startswith("default-src 'none'")


def test_the_script_never_parses_html() -> None:
    whole = script() + script(DRIVE_SCRIPTS)
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function", whole)
    scripts = {p.stem for p in (Path(__file__).parents[2] / "gear/view/page").glob("*.js")}
    assert scripts == {*SCRIPTS, *DRIVE_SCRIPTS}
    assert "</script" not in whole and "</style" not in asset("drives.css") and "</style" not in asset("style.css")


def test_a_small_budget_makes_small_pictures_and_links_the_files(write_dataset: Any, tmp_path: Path) -> None:
    root = write_dataset("stereo3d", 4)
    whole = write_view(root, tmp_path / "whole.html")
    small = write_view(root, tmp_path / "small.html", max_mb=whole.size_bytes / 2e6)
    assert small.scale < 1.0 == whole.scale
    assert small.size_bytes < whole.size_bytes * 0.75
    assert f"{small.scale:.0%}" in small.summary()
    page = Blocks(tmp_path / "small.html")
    for number, sample in enumerate(page.index["samples"]):
        for channel, picture in zip(page.index["channels"], sample["pictures"], strict=True):
            assert (picture["width"], picture["height"], picture["whole"]) == (408, 124, False)
            folder = {"left": "image_2", "right": "image_3"}[channel["name"]]
            original = f"./stereo3d/test/{folder}/{number:06d}.png" if channel["kind"] == "image" else None
            assert picture["original"] == original
            assert original is None or (tmp_path / original).is_file()
    index = Blocks(tmp_path / "whole.html").index
    kinds = [channel["kind"] for channel in index["channels"]]
    for sample in index["samples"]:  # at full size, too, for the files have no losses
        assert [p["original"] is not None for p in sample["pictures"]] == [kind == "image" for kind in kinds]


def test_only_the_first_samples_and_progress(write_dataset: Any, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    root = write_dataset("depth", 5)
    report = write_view(root, tmp_path / "page.html", samples=3, on_progress=lambda *seen: told.append(seen))
    assert report.samples == 3 and told == [(1, 3), (2, 3), (3, 3)]
    index = Blocks(tmp_path / "page.html").index
    assert [sample["index"] for sample in index["samples"]] == [0, 1, 2] and index["about"]["total"] == 5


def test_damaged_samples_and_bad_previews_are_said_and_not_fatal(
    opened: Callable[..., Dataset[Any]], tmp_path: Path
) -> None:
    dataset = opened("depth", 4)
    (dataset.root / "leftImg8bit/test/rgb_0001.png").unlink()
    (dataset.root / "leftImg8bit/test/rgb_0002.png").write_bytes(b"no picture")

    class Fickle:
        def preview(self, sample: Any) -> Any:
            if sample.record.index == 3:
                raise SyntaxError("not today")
            return dataset.task.preview(sample)

        def __getattr__(self, name: str) -> Any:
            return getattr(dataset.task, name)

    report = write_page(dataclasses.replace(dataset, task=Fickle()), tmp_path / "page.html")  # type: ignore[arg-type]
    assert [index for index, _ in report.problems] == [1, 2, 3]
    assert "rgb_0001.png" in report.problems[0][1] and "SyntaxError: not today" in report.problems[2][1]
    assert report.summary().count("\n") == 1
    page = Blocks(tmp_path / "page.html")
    there = [[picture is not None for picture in sample["pictures"]] for sample in page.index["samples"]]
    assert there == [[True, True, True], [False, False, False], [False, False, False], [True, False, False]]
    assert page.detail(1)["record"]["index"] == 1


def test_what_cannot_be_shown_or_written_is_one_line(write_dataset: Any, tmp_path: Path) -> None:
    root = write_dataset("depth", 1)
    with pytest.raises(DatasetError, match="is a folder of 1 dataset; give one of them"):
        write_view(tmp_path, tmp_path / "page.html")
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match="not a dataset"):
        write_view(tmp_path / "empty", tmp_path / "page.html")
    with pytest.raises(DatasetError, match="no split 'val'"):
        write_view(root, tmp_path / "page.html", split="val")
    (tmp_path / "file").write_text("")
    with pytest.raises(DatasetError, match="choose another --out"):
        write_view(root, tmp_path / "file/page.html")
    assert not list(tmp_path.glob("*.html")) and not list(tmp_path.glob(".*.part"))


def test_a_page_that_fails_leaves_the_old_one(
    opened: Callable[..., Dataset[Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = opened("depth", 1)
    write_page(dataset, tmp_path / "page.html")
    before = (tmp_path / "page.html").read_bytes()

    def broken(*_: Any) -> Any:
        yield "half"
        raise RuntimeError("stop")

    monkeypatch.setattr("gear.view.write.document", broken)
    with pytest.raises(RuntimeError):
        write_page(dataset, tmp_path / "page.html")
    assert (tmp_path / "page.html").read_bytes() == before and not list(tmp_path.glob(".*.part"))


def test_links_are_written_for_a_url(tmp_path: Path) -> None:
    root = tmp_path / "my data#1"
    root.mkdir()
    assert base_url(root, tmp_path / "out/page.html") == "./../my%20data%231/"
    assert base_url(root, root / "page.html") == "././"


def test_the_command_writes_a_page_and_says_where(
    write_dataset: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "view" in COMMANDS
    root = write_dataset("depth", 2)
    out = tmp_path / "x.html"
    assert main(["view", str(root), "--out", str(out), "--samples", "1"]) == 0
    assert capsys.readouterr().out.startswith(f"{out}: 1 sample, ")
    assert out.is_file()
    assert main(["view", str(tmp_path / "nothing")]) == 2
    with pytest.raises(SystemExit):
        main(["view", str(root), "--max-mb", "0"])


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("ink", ["ink", "dim", "accent", "patch", "pedestrian", "parked", "warn"])
@pytest.mark.parametrize("paper", ["ground", "panel", "raised"])
def test_words_can_be_read_on_what_they_stand(ink: str, paper: str) -> None:
    colours = dict(re.findall(r"--(\w+): (#[0-9a-f]{6});", asset("style.css")))
    bright, dark = sorted((luminance(colours[ink]), luminance(colours[paper])), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) >= 4.5
