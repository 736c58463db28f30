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
    words = ["leaderboard", "check", str(records / NAME), "--samples", "2", "--fresh", "2", "--seed", "3"]
    words += [word for text in HERE for word in ("--set", text)]
    assert main([*words, "--out", str(tmp_path / "checks")]) == 0
    out = capsys.readouterr().out
    assert out.endswith(f"{NAME}: reproduced\n") and "8 of 8 predictions have equal bytes" in out
    sha256 = hashlib.sha256((records / NAME).read_bytes()).hexdigest()
    verdict = read_verdict(tmp_path / "checks" / f"{sha256}.json")
    assert (verdict.state, verdict.repeated, verdict.fresh) == ("reproduced", 8, 8)


def test_a_figure_counts_only_when_it_was_computed_again(records: Path, checked: Checked) -> None:
    verdict = checked(records / NAME, samples=1)
    assert verdict.state == "incomplete" and not texts(verdict), "a mean IoU depends on all samples together"
    assert sum("it needs all 2 samples, 1 were measured" in text for text in texts(verdict, "note")) == 4

    def better(one: Record) -> Record:
        claimed = {"value": 0.99, "low": 0.99, "high": 0.99}
        results = tuple(
            dataclasses.replace(figure, **(claimed if figure.name == "miou" else {})) for figure in one.results
        )
        entry = dataclasses.replace(one.entry, lower_is_better=True)
        reference = tuple(dataclasses.replace(figure, value=0.5, low=0.5, high=0.5) for figure in one.reference)
        return dataclasses.replace(one, results=results, entry=entry, reference=reference)

    verdict = checked(forge(records / NAME, better), samples=2)
    assert verdict.state == "differs"
    assert sum("of all 2 samples is" in text for text in texts(verdict)) == 7, "four figures and three references"
    assert sum("without the defense, " in text for text in texts(verdict)) == 3
    assert any("disagree on whether lower is better" in text for text in texts(verdict))

    def nameless(one: Record) -> Record:
        samples = tuple(dataclasses.replace(sample, value=None) for sample in one.samples)
        return dataclasses.replace(one, samples=samples, sample_metric="nonsense")

    verdict = checked(forge(records / NAME, nameless), samples=1)
    assert verdict.state == "differs" and "samples: measured by miou, not by nonsense" in texts(verdict)


def test_a_config_of_another_shape_is_one_line(records: Path, checked: Checked) -> None:
    def two(one: Record) -> Record:
        data = tuple(replaced for row in one.data for replaced in (row, row))
        samples = tuple(dataclasses.replace(each, data=2 * each.data + more) for each in one.samples for more in (0, 1))
        results = tuple(dataclasses.replace(figure, n=2 * figure.n) for figure in one.results)
        return dataclasses.replace(one, data=data, samples=samples, results=results)

    with pytest.raises(GearError, match="makes 1 datasets of 2 samples with none, the record has 2 of 2, 2 samples"):
        checked(forge(records / NAME, two))

    def led_away(one: Record) -> Record:
        config = json.loads(json.dumps(one.benchmark.config))
        config["collect"]["root"] = "thesis"
        return dataclasses.replace(
            one, benchmark=dataclasses.replace(one.benchmark, config=config, sha256=digest(config))
        )

    with pytest.raises(GearError, match="'root' is decided by the benchmark"):
        checked(forge(records / NAME, led_away))


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
