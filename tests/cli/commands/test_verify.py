"""The flags, output and exit code of `gear verify`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from gear.cli.main import main
from gear.dataset.checks.verification import Finding
from gear.verbs.verify.report import VerifyReport

COMMAND = "gear.verbs.verify.run.verify"
DAMAGED = Finding(path="a.png", problem="damaged", detail="its hash differs")


def report(*findings: Finding) -> VerifyReport:
    return VerifyReport(root=Path("d"), files=3, findings=findings, repaired=(), unrepaired=())


def test_flags_reach_the_library(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    asked: dict[str, Any] = {}

    def verify(dataset: str, **values: Any) -> VerifyReport:
        asked.update(values, dataset=dataset)
        return report()

    monkeypatch.setattr(COMMAND, verify)
    assert main(["verify", "d", "--split", "test", "--repair", "--workers", "3", "--patch", "p.png"]) == 0
    assert {key: asked[key] for key in ("dataset", "split", "repair", "workers", "patch", "town")} == {
        "dataset": "d", "split": "test", "repair": True, "workers": 3, "patch": "p.png", "town": None,
    }  # fmt: skip
    assert capsys.readouterr().out.strip()


def test_a_damaged_file_gives_exit_code_1(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(COMMAND, lambda dataset, **values: report(DAMAGED))
    assert main(["verify", "d"]) == 1
    assert DAMAGED.line() in capsys.readouterr().out


def test_json_is_the_report(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(COMMAND, lambda dataset, **values: report(DAMAGED))
    assert main(["verify", "d", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(report(DAMAGED).as_json()))


def test_a_name_with_terminal_escapes_is_escaped(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = Finding(path="a\x1b[2J\n.png", problem="unexpected", detail="not written by gear")
    monkeypatch.setattr(COMMAND, lambda dataset, **values: report(odd))
    assert main(["verify", "d"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and r"a\x1b[2J\n.png" in lines[0]
