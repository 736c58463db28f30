from __future__ import annotations

import os
import sys
import types
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import PROTOCOL_VERSION, DefenseSpec
from gear.plugins.build import build
from gear.plugins.catalogue import Catalogue, PluginEntry
from gear.plugins.manager import discover
from gear.values.errors import DuplicateNameError, PluginError, UnknownNameError


@dataclass(frozen=True, kw_only=True)
class Config:
    radius_px: int = 2


class Same:
    def fit(self, clean: Any, patched: Any, model: Any, rng: np.random.Generator) -> None:
        return None

    def apply(self, views: Any, model: Any, state: Any, rng: np.random.Generator) -> Any:
        return views

    def forward(self, views: Any) -> Any:
        return views

    def wrap(self, model: Any) -> Any:
        return model


def spec(name: str, **changes: Any) -> DefenseSpec[Config]:
    facts: dict[str, Any] = {"summary": "Does nothing.", "config": Config, "build": lambda config: Same()} | changes
    return DefenseSpec(name=name, **facts)


def strangers(found: Catalogue) -> list[PluginEntry]:
    return [f for f in found.of_kind("defense") if f.owner.package != "mujoco-gear"]


@pytest.fixture
def package() -> Iterator[Any]:
    made: list[str] = []

    def make(name: str, hook: Any = None, **attributes: Any) -> EntryPoint:
        module = types.ModuleType(name)
        if hook is not None:
            module.gear_defenses = hookimpl(hook, specname="gear_defenses")  # type: ignore[attr-defined]
        for key, value in attributes.items():
            setattr(module, key, value)
        sys.modules[name] = module
        made.append(name)
        return EntryPoint(name=name.replace("_", "-"), value=name, group="gear")

    yield make
    for name in made:
        del sys.modules[name]


def test_a_plugin_is_found_with_its_owner(package: Any) -> None:
    found = discover([package("good_one", lambda: [spec("thirdparty")])])
    assert [(f.spec.name, f.owner.package) for f in strangers(found)] == [("thirdparty", "good_one")]
    assert found.get("defense", "thirdparty") is found.get("defense", "good_one/thirdparty")
    assert found.broken == ()


def test_built_in_tasks_come_by_the_same_hooks() -> None:
    assert set(discover([]).names("task")) >= {"semseg", "detect2d", "stereo3d", "depth"}


def test_broken_plugins_are_reported_and_the_others_work(package: Any, capsys: pytest.CaptureFixture[str]) -> None:
    def leaves() -> list[Any]:
        sys.exit(3)

    def raises() -> list[Any]:
        raise KeyError("boom")

    def talks() -> list[Any]:
        print("hello")
        return [spec("talker")]

    misspelt = types.ModuleType("misspelt")
    misspelt.gear_defences = hookimpl(lambda: [spec("lost")])  # type: ignore[attr-defined]
    sys.modules["misspelt"] = misspelt
    entries = [
        package("aa_good", lambda: [spec("thirdparty")]),
        EntryPoint(name="bb-missing", value="no_such_module_anywhere", group="gear"),
        package("cc_leaves", leaves),
        package("dd_raises", raises),
        package("ee_rubbish", lambda: [3, "x"]),
        package("ff_number", lambda: 7),
        package("gg_old", lambda: [spec("old", protocol=PROTOCOL_VERSION + 1)]),
        package("hh_name", lambda: [spec("Bad Name")]),
        package("ii_talks", talks),
        EntryPoint(name="jj-misspelt", value="misspelt", group="gear"),
    ]
    found = discover(entries)
    del sys.modules["misspelt"]
    assert [f.spec.name for f in strangers(found)] == ["talker", "thirdparty"]
    stages = {b.owner.plugin: (b.stage, b.problem) for b in found.broken}
    assert stages["bb-missing"][0] == "import"
    assert stages["cc-leaves"] == ("hook gear_defenses", "SystemExit: 3")
    assert "boom" in stages["dd-raises"][1]
    assert [b.problem for b in found.broken if b.owner.plugin == "ee-rubbish"] == [
        "gear_defenses returns DefenseSpec objects, got int",
        "gear_defenses returns DefenseSpec objects, got str",
    ]
    assert "got int" in stages["ff-number"][1]
    assert "speaks protocol" in stages["gg-old"][1]
    assert "'Bad Name' is not a plugin's name" in stages["hh-name"][1]
    assert stages["jj-misspelt"][0] == "register"
    assert capsys.readouterr().out == ""
    with pytest.raises(
        UnknownNameError, match=r"no defense named 'thirdprty'; did you mean thirdparty\? \(.*failed to load: "
    ):
        found.get("defense", "thirdprty")
    assert found.broken_hint().startswith(f"({len(stages)} plugin(s) failed to load: ")


def test_working_folder_and_stderr_are_restored(package: Any, tmp_path: Path) -> None:
    def moves() -> list[Any]:
        os.chdir(tmp_path)
        sys.stderr = None  # type: ignore[assignment]
        return []

    folder, stderr = Path.cwd(), sys.stderr
    assert discover([package("moves", moves)]).broken == ()
    assert (Path.cwd(), sys.stderr) == (folder, stderr)


def test_two_plugins_with_one_name_are_both_refused(package: Any) -> None:
    found = discover([package("one", lambda: [spec("thirdparty")]), package("two", lambda: [spec("thirdparty")])])
    with pytest.raises(DuplicateNameError, match="one/thirdparty, two/thirdparty"):
        found.get("defense", "thirdparty")
    assert found.get("defense", "two/thirdparty").owner.package == "two"
    assert tuple(n for n in found.names("defense") if "/" in n) == ("one/thirdparty", "two/thirdparty")
    assert found.clashes() == (("defense", "thirdparty", ("one/thirdparty", "two/thirdparty")),)


def test_plugins_can_be_switched_off(package: Any) -> None:
    entry = package("good_one", lambda: [spec("thirdparty")])
    assert strangers(discover([entry], "good-one")) == []
    assert strangers(discover([entry], "*")) == []


def test_every_option_needs_a_default(package: Any) -> None:
    @dataclass(frozen=True)
    class Needy:
        radius_px: int

    found = discover([package("needy", lambda: [spec("thirdparty", config=Needy)])])
    assert found.broken[0].problem == "'thirdparty': every option needs a default"


def test_a_build_that_leaves_says_whose_it_is(package: Any) -> None:
    found = discover([package("good_one", lambda: [spec("thirdparty", build=lambda config: sys.exit(3))])])
    with pytest.raises(PluginError, match=r"thirdparty \(good_one \?\) failed at build: SystemExit: 3"):
        build(found.get("defense", "thirdparty"))


def test_a_build_that_fails_says_whose_it_is(package: Any) -> None:
    def fails(config: Config) -> Same:
        raise RuntimeError("no such file")

    found = discover([package("good_one", lambda: [spec("thirdparty", build=fails)])])
    with pytest.raises(PluginError, match=r"thirdparty \(good_one \?\) failed at build: RuntimeError: no such file"):
        build(found.get("defense", "thirdparty"))
