"""The page of drives: one file, escaped texts, budget, problems; and in a real browser."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from gear.cli.main import main
from gear.driving.measures import Measures
from gear.values.errors import DatasetError
from gear.view.drive_page import drive_page, outcome
from gear.view.write import write_view

from .browser import Browser
from .drive_studies import change_run

RUN = "document.title='ran'"
EVIL = f"""</script><script>{RUN}</script><img src=x onerror="{RUN}">'"{{{{script}}}}"""


@pytest.fixture
def study(drive_study: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(drive_study, tmp_path / "study"))


def index_of(page: str) -> dict[str, object]:
    found = re.search(r'<script type="application/json" id="index">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def test_the_page_is_one_file_with_every_drive(study: Path, tmp_path: Path) -> None:
    report = write_view(study, tmp_path / "view.html")
    page = (tmp_path / "view.html").read_text()
    assert report.samples == 3 and report.problems == () and "3 drives" in report.summary()
    assert len(re.findall(r'id="d\d+"', page)) == 3 and len(re.findall(r'id="f\d+"', page)) == 1
    assert not re.search(r'(src|href)="(?!#|data:)', page), "nothing is loaded"
    assert re.search(r"{{\w+}}", page) is None
    again = write_view(study, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == page.encode() and again.size_bytes == report.size_bytes


def test_small_budgets_show_fewer_and_smaller_pictures(study: Path) -> None:
    whole = drive_page([study], most=None, budget_bytes=1e9, on_progress=None)
    tiny = drive_page([study], most=None, budget_bytes=1.0, on_progress=None)
    assert whole.index["step"] == 1 and whole.scale == 1.0 and whole.films[1].count("\n") == 5
    assert tiny.index["step"] == 10 and tiny.scale < 0.2 and tiny.films[1].count("\n") == 1, "the first and the last"


def test_damaged_drives_are_named_and_the_others_shown(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blind, patched = sorted((study / "drives/blind").iterdir())
    (blind / "log.jsonl").write_text("damaged")
    (patched / "video.mp4").write_bytes(b"no video")
    next((study / "drives/truth").glob("*/result.json")).write_text("{")
    assert main(["view", str(study), "--out", str(tmp_path / "v.html")]) == 1
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == 2 and shown[1].startswith("3 not shown in full; first, drives/truth/")
    index = index_of((tmp_path / "v.html").read_text())
    problems = [drive["problem"] for drive in index["drives"]]  # type: ignore[attr-defined]
    assert problems[0].endswith("log.jsonl: is damaged") and "video.mp4: no video" in problems[1]
    assert len(index["problems"]) == 1  # type: ignore[arg-type]


def test_a_study_without_a_drive_is_one_line(study: Path, tmp_path: Path) -> None:
    shutil.rmtree(study / "drives")
    (study / "drives").mkdir()
    with pytest.raises(DatasetError, match="no finished drive"):
        write_view(study, tmp_path / "v.html")
    with pytest.raises(DatasetError, match="no split"):
        write_view(study, tmp_path / "v.html", split="test")


def test_towns_of_files_are_not_read(study: Path) -> None:
    """The town in a stranger's result must not decide which files are read."""
    towns = ["../../etc/passwd", "/etc/passwd", "town10"]
    for folder, town in zip(sorted((study / "drives").glob("*/*")), towns, strict=True):
        change_run(folder, town=town)
    assert list(drive_page([study], most=None, budget_bytes=1e6, on_progress=None).index["streets"]) == ["town10"]


def test_outcomes_in_words() -> None:
    values = dict.fromkeys(Measures.__dataclass_fields__, 0.0) | {
        "ending": "stood",
        "is_crash": False,
        "crash_kind": "",
    }
    assert outcome(Measures(**values)) == "stopped"  # type: ignore[arg-type]
    crash = values | {"is_crash": True, "crash_kind": "person", "impact_mps": 10.0}
    assert outcome(Measures(**crash)) == "crash with a person at 36 km/h"  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_page_plays_drives_in_a_browser(study: Path, tmp_path: Path, browser: Browser) -> None:
    blind, patched = sorted((study / "drives/blind").iterdir())
    for folder in (blind, patched):
        change_run(folder, scenario=EVIL)
    write_view(study, tmp_path / "view.html")
    browser.open(tmp_path / "view.html")
    browser.until("document.querySelectorAll('.films figure').length === 2")
    assert browser.errors == [] and browser.requests == [] and browser.value("document.title") != "ran"
    assert EVIL in browser.value("document.querySelector('#situation h2').textContent")
    assert browser.value("[...document.querySelectorAll('#situations a')].length") == 2
    assert "crash with a vehicle at 40 km/h" in browser.value("document.querySelector('#situations a').textContent")
    paint = "new Promise((d) => requestAnimationFrame(() => d(document.querySelector('.map canvas').toDataURL())))"
    brightness = """(() => {
      const img = document.querySelector('.films img'), canvas = document.createElement('canvas');
      [canvas.width, canvas.height] = [1, 1];
      const pen = canvas.getContext('2d');
      pen.drawImage(img, 0, 0, 1, 1);
      return img.complete && img.naturalWidth ? pen.getImageData(0, 0, 1, 1).data[0] : -1;
    })()"""
    browser.until(f"{brightness} >= 0")
    seen = []
    for frame in (0, 2, 1000):
        browser.value(f"(() => {{ const s = document.getElementById('frame'); s.value = {frame};"
                      " s.dispatchEvent(new Event('input')); })()")  # fmt: skip
        browser.until(f"Math.abs({brightness} - {min(40 * frame, 200)}) < 8")
        seen.append(browser.value(paint))
    assert len(set(seen)) == 3, "the marker on the map moves with the frame"
    assert browser.value("document.querySelector('.crashed figcaption') !== null")
    browser.value("document.body.focus()")
    browser.press("ArrowLeft")
    ends = browser.value("[document.getElementById('frame').max, document.getElementById('frame').value].map(Number)")
    assert ends[0] - ends[1] == 1
    browser.value("document.getElementById('different').click()")
    assert browser.value("document.querySelectorAll('#situations a').length") == 0
    browser.value("location.hash = '#/situation/1'")
    browser.until("document.querySelector('#situation h2').textContent.startsWith('truth')")
    browser.value("document.getElementById('play').click()")
    browser.until("Number(document.getElementById('frame').value) > 3")
    assert browser.errors == []
