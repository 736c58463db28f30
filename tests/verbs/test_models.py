from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from gear.cli.main import main
from gear.contracts.specs import ModelSpec
from gear.measuring.appearance_hash import Appearance, current_appearance
from gear.networks import shipped
from gear.networks.weights import write
from gear.plugins.manager import catalogue
from gear.values.serial import to_json
from gear.verbs import models
from gear.verbs.models import list_models


def ship(folder: Path, name: str, **facts: object) -> None:
    metadata = {key: value if isinstance(value, str) else json.dumps(value) for key, value in facts.items()}
    write(folder / "models" / f"{name}.safetensors", {"a": torch.zeros(3)}, metadata)


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(shipped, "shipped_folders", lambda: (tmp_path,))
    return tmp_path


def test_networks_are_listed_with_what_is_published(packages: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--task", "semseg", "--json"]) == 0
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)["models"]}
    ddrnet = listed["ddrnet23_slim"]
    assert ddrnet["parameters"] == 5_734_342 and ddrnet["tasks"] == ["semseg"] and ddrnet["is_trainable"]
    assert "ImageNet" in ddrnet["normalisation"]
    assert "ydhongHIT/DDRNet" in ddrnet["published"][0]["source"] and "Cityscapes" in ddrnet["published"][0]["licence"]
    assert ddrnet["published"][0]["size_mb"] == pytest.approx(23, abs=1)
    assert ddrnet["shipped"] is None and ddrnet["missing"] == []
    assert all("semseg" in entry["tasks"] for entry in listed.values())
    assert main(["models", "--task", "semseg"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    (line,) = [line for line in lines if line.startswith("ddrnet23_slim")]
    assert line.split()[:5] == ["ddrnet23_slim", "semseg", "5.7", "M", "published"]
    assert main(["models", "show", "ddrnet23_slim"]) == 0
    text = capsys.readouterr().out
    assert "5.7 M parameters" in text and "shipped    none" in text
    assert main(["models", "show", "ddrnet23_slin"]) == 2 and "did you mean ddrnet23_slim?" in capsys.readouterr().err
    assert main(["models", "show"]) == 2 and "needs a name" in capsys.readouterr().err
    assert main(["models", "--task", "semsag"]) == 2
    assert "did you mean semseg?" in capsys.readouterr().err


def test_every_builtin_network_says_how_large_it_is() -> None:
    for model in list_models():
        if model.found.owner.package == "mujoco-gear" and model.spec.published:
            assert model.spec.parameters > 0, model.spec.name
            assert model.spec.normalisation, model.spec.name


def test_reference_weights_are_shown_and_marked_when_the_look_changed(
    packages: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blank = Appearance(assets={"town10": ""}, renderers=("filament",), light="", mujoco="")
    now = current_appearance(blank)
    old = dataclasses.replace(now, assets={"town10": "0" * 64})
    facts = {"metrics": {"miou": 0.625}, "data": {"training": [{"scene": "billboard01"}]}}
    ship(packages, "ddrnet23_slim", look=to_json(now), look_hash=now.hash, **facts)
    ship(packages, "bisenet_x39", look=to_json(old), look_hash=old.hash, **facts)
    listed = {entry.spec.name: entry.to_json()["shipped"] for entry in list_models("semseg")}
    fresh, stale = listed["ddrnet23_slim"], listed["bisenet_x39"]
    assert fresh["metrics"] == {"miou": 0.625} and fresh["data"] == facts["data"]
    assert fresh["look_hash"] == now.hash and fresh["look_is_current"] is True and fresh["look_changes"] == []
    assert stale["look_is_current"] is False and stale["look_changes"] == ["assets of town10"]
    assert main(["models"]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert "shipped, old appearance" in lines["bisenet_x39"] and "old appearance" not in lines["ddrnet23_slim"]
    assert main(["models", "show", "ddrnet23_slim"]) == 0
    assert "miou 0.625; appearance is current" in capsys.readouterr().out
    assert main(["models", "show", "bisenet_x39"]) == 0
    assert "trained on another appearance (assets of town10 changed)" in " ".join(capsys.readouterr().out.split())


def test_weights_that_do_not_state_their_look_are_not_judged(packages: Path) -> None:
    ship(packages, "ddrnet23_slim", look_hash="0123456789abcdef")
    (model,) = [entry for entry in list_models() if entry.spec.name == "ddrnet23_slim"]
    assert model.shipped is not None and model.shipped.to_json()["look_is_current"] is None


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    found = catalogue()
    (ddrnet,) = [entry for entry in found.found if entry.spec.name == "ddrnet23_slim"]
    assert isinstance(ddrnet.spec, ModelSpec)
    needy = dataclasses.replace(ddrnet, spec=dataclasses.replace(ddrnet.spec, needs=("json", "no_such_module.part")))
    monkeypatch.setattr(models, "catalogue", lambda: dataclasses.replace(found, found=(needy,)))
    assert list_models()[0].missing == ("no_such_module.part",)
    assert main(["models"]) == 0
    assert "needs no_such_module.part" in capsys.readouterr().out
    assert main(["models", "show", "ddrnet23_slim"]) == 0
    assert "not usable  needs no_such_module.part" in capsys.readouterr().out


def test_listing_never_imports_torch() -> None:
    code = "import sys; from gear.cli.main import main; main(['models', '--json']); sys.exit('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
