"""What `gear doctor` reports, from the command line and from Python."""

from __future__ import annotations

import json

import pytest

import gear
from gear.cli.main import main
from gear.values.errors import BackendError
from gear.verbs import doctor as module


def test_a_working_renderer_is_described(capsys: pytest.CaptureFixture[str]) -> None:
    report = gear.doctor("classic")
    (check,) = report.renderers
    assert report.works and check.name == "classic" and {"device", "driver", "frame_s"} <= check.facts.keys()
    assert report.machine["cores"] >= 1 and "classic: works" in report.summary()
    assert main(["doctor", "--renderer", "classic", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["renderers"]["classic"]["works"] is True


def test_without_any_renderer_the_exit_code_is_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(name: str) -> None:
        raise BackendError(name, "no driver", "install one")

    monkeypatch.setattr(module, "probe", broken)
    report = gear.doctor()
    assert not report.works and [check.name for check in report.renderers] == ["raster", "filament", "classic"]
    assert main(["doctor"]) == 2
    assert capsys.readouterr().out.count("does not work") == 3
    assert main(["doctor", "--renderer", "none"]) == 2 and "no renderer named" in capsys.readouterr().err
