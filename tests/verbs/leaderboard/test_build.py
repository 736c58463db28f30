"""`gear leaderboard build`: pages of a folder of records, in which strangers' texts are escaped."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gear.cli.main import main
from gear.leaderboard.reading import encoded
from gear.leaderboard.record import canonical
from gear.leaderboard.verdict import Verdict
from gear.values.errors import GearError
from gear.verbs.leaderboard.build import build_leaderboard
from tests.leaderboard.conftest import VALUES, attacking, figures, filed, plugin, record, sha

EVIL = "<script>alert(1)</script>\" onload='x'"


class Tags(HTMLParser):
    """Collects the tags and the text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        assert not any(name.startswith("on") for name, _ in attrs)

    def handle_data(self, data: str) -> None:
        self.text += data


def put(folder: Path, name: str, data: bytes) -> None:
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(data)


def test_pages_of_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    alone = record(
        {"none": 0.71, "random": 0.68, "patch": 0.30, "patch of other": 0.45}, reference=(),
        entry={"kind": "model", "defense": None, "gradient": None},
    )  # fmt: skip
    evil = record(entry={"defense": plugin("evil"), "authors": EVIL, "paper": EVIL})
    stronger = attacking(record(), 0.42, knowledge="black-box", steps=0, queries=900)
    for name, one in {"a": record(), "b": alone, "c": evil, "d": stronger}.items():
        put(tmp_path / "records", f"{name}.json", encoded(one))
    put(tmp_path / "records", "e.json", b"{}")
    sha256 = filed(stronger).sha256
    verdict = Verdict(
        record_sha256=sha256, state="reproduced", seed=0, repeated=1, fresh=0, environment={}, findings=()
    )
    put(tmp_path / "checks", f"{sha256}.json", verdict.encoded())
    put(tmp_path / "checks", f"{sha('x')}.json", verdict.encoded())
    words = ["leaderboard", "build", str(tmp_path / "records"), "--out", str(tmp_path / "site")]
    assert main([*words, "--checks", str(tmp_path / "checks"), "--commitment", sha("secret")]) == 0
    out = capsys.readouterr().out
    assert "3 rows, 3 of them ranked, in 1 table" in out
    assert "e.json: is no gear-record" in out and "is the verdict of another record" in out
    index = Tags((tmp_path / "site/index.html").read_text())
    assert "script" not in index.tags and sha("secret") in index.text
    assert "0.420 [0.420, 0.420] (patch, theirs (their-package 0.1), by others)" in index.text
    assert "other: 0.450 [0.430, 0.470]" in index.text and "900 queries" not in index.text
    board = json.loads((tmp_path / "site/board.json").read_text())
    rows = board["tables"][0]["rows"]
    assert [(row["defense"], row["worst"]["value"]) for row in rows] == [("evil", 0.5), ("guard", 0.42), ("-", 0.3)]
    page = Tags((tmp_path / "site/records" / f"{filed(evil).sha256}.html").read_text())
    assert "script" not in page.tags and EVIL in page.text


def test_same_records_give_the_same_pages(tmp_path: Path) -> None:
    put(tmp_path / "records", "a.json", encoded(record()))
    put(tmp_path / "records", "copy.json", encoded(record()))
    for site in ("one", "two"):
        build_leaderboard(tmp_path / "records", out=tmp_path / site)
    pages = [{p.name: p.read_bytes() for p in (tmp_path / site).rglob("*.html")} for site in ("one", "two")]
    assert pages[0] == pages[1] and len(pages[0]) == 3


def test_faults_and_flags_stand_on_the_page(tmp_path: Path) -> None:
    weak = replace(record(), results=figures({**VALUES, "adaptive patch": 0.65}))
    put(tmp_path / "records", "a.json", encoded(weak))
    put(tmp_path / "records", "b.json", encoded(record(entry={"defense": plugin("dice"), "is_random": True})))
    build_leaderboard(tmp_path / "records", out=tmp_path / "site")
    text = Tags((tmp_path / "site/index.html").read_text()).text
    assert "flag: adaptive patches are no worse" in text and "not ranked, because the defense is random" in text


def test_a_wrong_commitment_or_folder_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(GearError, match="must be a SHA-256"):
        build_leaderboard(tmp_path, out=tmp_path / "site", commitment="<b>")
    with pytest.raises(GearError, match="cannot be read"):
        build_leaderboard(tmp_path / "none", out=tmp_path / "site")


def test_names_and_keys_of_strangers_are_printable(tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    texts = {
        b"\xff.json": b"{}",
        b"\x1b[2J.json": b"{}",
        b"key.json": canonical({"format": "gear-record", "version": 1, "\x1b]0;x": 1}),
        b"version.json": canonical({"format": "gear-record", "version": "\x1b[31m\u202e"}),
    }
    (tmp_path / "records").mkdir()
    for name, data in texts.items():
        (tmp_path / "records" / os.fsdecode(name)).write_bytes(data)
    assert main(["leaderboard", "build", str(tmp_path / "records"), "--out", str(tmp_path / "site")]) == 0
    out = capsysbinary.readouterr().out.decode()
    lines = out.splitlines()
    assert len(lines) == 5 and all(line.isprintable() for line in lines), out
    assert "\\udcff.json: is no gear-record" in out and "\\x1b[2J.json" in out
    assert "\x1b" not in (tmp_path / "site/index.html").read_text() + (tmp_path / "site/board.json").read_text()


def test_pages_of_withdrawn_records_are_removed(tmp_path: Path) -> None:
    records, site = tmp_path / "records", tmp_path / "site"
    gone = record(entry={"defense": plugin("gone")})
    for name, one in {"a.json": record(), "b.json": gone}.items():
        put(records, name, encoded(one))
    build_leaderboard(records, out=site)
    pages = site / "records"
    foreign = {f"{sha('mine')}.html": "<p>mine</p>", "notes.html": (pages / f"{filed(gone).sha256}.html").read_text()}
    for name, text in foreign.items():
        (pages / name).write_text(text)
    outside = tmp_path / "outside.html"
    outside.write_text(foreign["notes.html"])
    (pages / f"{sha('link')}.html").symlink_to(outside)
    (records / "b.json").unlink()
    build_leaderboard(records, out=site)
    kept = {f"{filed(record()).sha256}.html", f"{sha('link')}.html", *foreign}
    assert {path.name for path in pages.iterdir()} == kept and outside.exists()


def test_no_page_is_removed_through_a_link(tmp_path: Path) -> None:
    put(tmp_path / "records", "a.json", encoded(record()))
    build_leaderboard(tmp_path / "records", out=tmp_path / "one")
    (tmp_path / "records/a.json").unlink()
    (tmp_path / "two").mkdir()
    (tmp_path / "two/records").symlink_to(tmp_path / "one/records")
    with pytest.raises(GearError, match="link"):
        build_leaderboard(tmp_path / "records", out=tmp_path / "two")
    assert len(list((tmp_path / "one/records").iterdir())) == 1


@pytest.mark.parametrize("name", ["index.html", "board.json", "thesis.tex", "records/notes.txt"])
def test_files_of_somebody_else_are_not_replaced(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    put(tmp_path / "records", "a.json", encoded(record()))
    mine = tmp_path / "site" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("{}")
    assert main(["leaderboard", "build", str(tmp_path / "records"), "--out", str(tmp_path / "site")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    shown = name.partition("/")[0]
    assert f"holds files that are no pages of gear's, such as {shown!r}; use another --out" in line
    assert [path.relative_to(tmp_path / "site").as_posix() for path in mine.parent.iterdir()] == [name]
    assert mine.read_text() == "{}"


def test_what_somebody_adds_to_finished_pages_stays(tmp_path: Path) -> None:
    put(tmp_path / "records", "a.json", encoded(record()))
    site = tmp_path / "site"
    (site / ".git").mkdir(parents=True)
    build_leaderboard(tmp_path / "records", out=site)
    (site / "CNAME").write_text("board.example")
    build_leaderboard(tmp_path / "records", out=site)
    assert (site / "CNAME").read_text() == "board.example"
    for name in ("index.html", "drives.html"):  # what a run that is killed after its first file leaves
        (site / name).unlink()
    build_leaderboard(tmp_path / "records", out=site)
    assert (site / "index.html").exists()


def test_the_board_of_gears_own_records(tmp_path: Path) -> None:
    board = Path(__file__).parents[3] / "docs/results/board"
    build_leaderboard(board / "records", checks=board / "checks", out=tmp_path / "site")
    made = json.loads((tmp_path / "site/board.json").read_text())
    (table,) = made["tables"]
    assert made["refused"] == [] and all(row["is_ranked"] for row in table["rows"])
    states = {row["defense"]: row["state"] for row in table["rows"]}
    reproduced = dict.fromkeys(("-", "lgs", "hyperneuron"), "reproduced")
    assert states == dict.fromkeys(("zmask", "fpda"), "claimed") | reproduced
