"""`gear leaderboard check`: honest records are reproduced; forged ones, and defenses that cheat, are seen."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.cli.main import main
from gear.contracts.defenses import DefenseResult
from gear.leaderboard.reading import encoded, read_record
from gear.leaderboard.record import Record, digest
from gear.leaderboard.verdict import Verdict, read_verdict
from gear.plugins.defenses.per_picture import PerPicture
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError
from tests.verbs.leaderboard.conftest import HERE

pytestmark = pytest.mark.slow  # a tiny benchmark is made, and some of its samples again

NAME = "semseg-small+blur-seed0.json"

Checked = Callable[..., Verdict]


@pytest.fixture
def checked(tmp_path: Path) -> Checked:
    """Checks a record with few samples."""

    def check(path: Path, **arguments: Any) -> Verdict:
        chosen: dict[str, Any] = {"samples": 2, "fresh": 0, "settings": HERE, "work": tmp_path / "work"}
        return gear.check_record(path, **(chosen | arguments))

    return check


def texts(verdict: Verdict, level: str = "differs") -> list[str]:
    return [one.text for one in verdict.findings if one.level == level]


def forge(path: Path, change: Callable[[Record], Record]) -> Path:
    """Writes a record with other values, in canonical form, as a forger would."""
    forged = path.with_name("forged.json")
    forged.write_bytes(encoded(change(read_record(path).record)))
    return forged


def test_an_honest_record_is_reproduced(records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["leaderboard", "check", str(records / NAME), "--samples", "1", "--fresh", "2", "--seed", "3"]
    words += [word for text in HERE for word in ("--set", text)]
    assert main([*words, "--out", str(tmp_path / "checks")]) == 0
    out = capsys.readouterr().out
    assert out.endswith(f"{NAME}: reproduced\n") and "4 of 4 predictions have equal bytes" in out
    sha256 = hashlib.sha256((records / NAME).read_bytes()).hexdigest()
    verdict = read_verdict(tmp_path / "checks" / f"{sha256}.json")
    assert (verdict.state, verdict.repeated, verdict.fresh) == ("reproduced", 4, 8)


def test_a_forged_record_is_seen(records: Path, checked: Checked) -> None:
    other = hashlib.sha256(b"x").hexdigest()

    def better(one: Record) -> Record:
        samples = tuple(dataclasses.replace(sample, value=0.99, sha256=other) for sample in one.samples)
        network = dataclasses.replace(one.entry.network, weights_sha256=other, options={"seed": 9, "width": 8})
        entry = dataclasses.replace(one.entry, network=network)
        data = tuple(dataclasses.replace(row, content_key=other if row.patch == "none" else row.content_key)
                     for row in one.data)  # fmt: skip
        return dataclasses.replace(one, samples=samples, entry=entry, data=data)

    verdict = checked(forge(records / NAME, better), samples=1)
    assert verdict.state == "differs"
    for problem in (
        "the record says 0.99", "another prediction than in the record", "other weights",
        "its config names tiny_segmenter otherwise", "other data than the record's content key",
    ):  # fmt: skip
        assert any(problem in text for text in texts(verdict)), problem


def test_what_a_check_cannot_do_is_one_line(records: Path, checked: Checked) -> None:
    with pytest.raises(GearError, match="would render"):
        checked(records / NAME, fresh=5000)
    with pytest.raises(GearError, match="belong together"):
        checked(records / NAME, commitment=hashlib.sha256(b"x").hexdigest())
    for patch in (records / "patches").iterdir():
        patch.write_bytes(b"another picture")
    with pytest.raises(GearError, match="is not the patch of that hash"):
        checked(records / NAME)

    def huge(one: Record) -> Record:
        config = json.loads(json.dumps(one.benchmark.config))
        config["collect"]["options"]["width_px"] = 10**8
        benchmark = dataclasses.replace(one.benchmark, config=config, sha256=digest(config))
        return dataclasses.replace(one, benchmark=benchmark)

    with pytest.raises(GearError, match=r"width_px is 100000000; at most 8192"):
        checked(forge(records / NAME, huge))


def test_a_defense_that_behaves_otherwise_in_a_check_is_seen(
    records: Path, checked: Checked, monkeypatch: pytest.MonkeyPatch
) -> None:
    def apply(self: Any, views: Any, *_: Any) -> DefenseResult:
        return DefenseResult(views={name: picture // 8 for name, picture in views.items()})

    monkeypatch.setattr(PerPicture, "apply", apply)
    verdict = checked(records / NAME, samples=1)
    assert verdict.state == "differs"
    assert any("another prediction than in the record" in text for text in texts(verdict))


def test_withheld_scenes_are_measured_with_and_without_the_defense(
    records: Path, tmp_path: Path, checked: Checked, capsys: pytest.CaptureFixture[str]
) -> None:
    secret = tmp_path / "withheld.json"
    secret.write_text(json.dumps({"salt": "0" * 32, "seed": 7, "places": {str(TINY_TOWN): [f"{TINY_SCENES}:board"]}}))
    assert main(["leaderboard", "commit", str(secret)]) == 0
    commitment = capsys.readouterr().out.strip()
    verdict = checked(records / NAME, samples=1, fresh=1, withheld=secret, commitment=commitment)
    assert any(text.startswith("withheld scenes, patch: the defense gains") for text in texts(verdict, "note"))
    secret.write_text(secret.read_text().replace('"seed": 7', '"seed": 8'))
    with pytest.raises(GearError, match="not the published"):
        checked(records / NAME, withheld=secret, commitment=commitment)
