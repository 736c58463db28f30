"""`gear plugins`: what is installed, what is broken, what clashes."""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint
from typing import Any

import pytest

from gear.cli.commands.plugins import OPTION_FLAGS
from gear.cli.main import main
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import KINDS, DefenseSpec
from gear.plugins import manager


@dataclass(frozen=True, kw_only=True)
class Inner:
    """Nested.

    Attributes:
        eps_levels: how far a pixel may move.
    """

    eps_levels: float = 8.0


@dataclass(frozen=True, kw_only=True)
class Config:
    """Options.

    Attributes:
        radius_px: how far the window
            reaches.
        names, words: two of a kind.
    """

    radius_px: int = 2
    names: tuple[str, ...] = ()
    words: tuple[str, ...] = ("a", "b")
    inner: Inner = field(default_factory=Inner)


def nothing(config: Config) -> Any:
    return None


def spec(name: str, **facts: Any) -> DefenseSpec[Config]:
    return DefenseSpec(name=name, summary="Does nothing.", config=Config, build=nothing, **facts)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    made: list[str] = []
    entries: list[EntryPoint] = []

    def install(name: str, hook: Callable[[], Any]) -> None:
        module = types.ModuleType(name)
        module.gear_defenses = hookimpl(hook, specname="gear_defenses")  # type: ignore[attr-defined]
        sys.modules[name] = module
        made.append(name)
        entries.append(EntryPoint(name=name.replace("_", "-"), value=name, group="gear"))

    monkeypatch.setattr(manager, "installed_entry_points", lambda group: (entries, []))
    monkeypatch.setattr(manager, "unsafe_plugins", lambda entry_points: {})
    manager.catalogue.cache_clear()
    yield install
    manager.catalogue.cache_clear()
    for name in made:
        del sys.modules[name]


def fails() -> Any:
    raise KeyError("boom")


def test_the_list_says_what_everything_is_and_can(
    installed: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("good_one", lambda: [spec("thirdparty", tasks=("depth",), gradient="surrogate")])
    assert main(["plugins"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["defense", "thirdparty", "good_one", "?", "Does", "nothing."] in lines
    assert ["task", "semseg", "mujoco-gear"] in [line[:3] for line in lines]
    assert main(["plugins", "show", "thirdparty"]) == 0
    out = capsys.readouterr().out
    assert "tasks: depth" in out and "gradient: surrogate" in out and "needs_calibration: no" in out
    assert main(["plugins", "--kind", "defense"]) == 0
    out = capsys.readouterr().out
    assert "thirdparty" in out and "semseg" not in out


def test_json_has_plugins_broken_and_clashes(
    installed: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("one", lambda: [spec("thirdparty")])
    installed("two", lambda: [spec("thirdparty")])
    installed("bad", fails)
    assert main(["plugins", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    mine = [p for p in facts["plugins"] if p["name"] == "thirdparty"]
    assert [p["package"] for p in mine] == ["one", "two"]
    assert mine[0]["capabilities"]["outputs"] == ["images"]
    assert facts["broken"] == [
        {
            "plugin": "bad",
            "package": "bad",
            "version": "?",
            "stage": "hook gear_defenses",
            "problem": "KeyError: 'boom'",
        }
    ]
    assert facts["clashes"] == [
        {"kind": "defense", "name": "thirdparty", "choices": ["one/thirdparty", "two/thirdparty"]}
    ]


def test_broken_ones_and_clashes_have_a_line_with_what_to_do(
    installed: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("one", lambda: [spec("thirdparty")])
    installed("two", lambda: [spec("thirdparty")])
    installed("bad_one", fails)
    assert main(["plugins"]) == 0
    lines = capsys.readouterr().out.splitlines()
    (broken,) = [line for line in lines if line.startswith("broken")]
    assert "bad-one" in broken and "at hook gear_defenses: KeyError: 'boom'" in broken
    assert broken.endswith("or set GEAR_DISABLE_PLUGINS=bad-one")
    (clash,) = [line for line in lines if line.startswith("clash")]
    assert clash.endswith("defense: say one/thirdparty or two/thirdparty")
    assert main(["plugins", "show", "thirdparty"]) == 2
    assert "more than one defense is named 'thirdparty'" in capsys.readouterr().err
    assert main(["plugins", "show", "two/thirdparty"]) == 0


def test_strict_makes_a_broken_one_an_error(installed: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plugins", "--strict-plugins"]) == 0
    installed("bad", fails)
    manager.catalogue.cache_clear()
    capsys.readouterr()
    assert main(["plugins", "--strict-plugins"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == "gear: plugin bad (bad ?) failed at hook gear_defenses: KeyError: 'boom'\n"


def test_plugins_can_be_switched_off(
    installed: Callable[..., None], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    installed("good_one", lambda: [spec("thirdparty")])
    installed("bad", fails)
    monkeypatch.setenv("GEAR_DISABLE_PLUGINS", "bad")
    assert main(["plugins"]) == 0
    out = capsys.readouterr().out
    assert "thirdparty" in out and "broken" not in out
    monkeypatch.setenv("GEAR_DISABLE_PLUGINS", "*")
    manager.catalogue.cache_clear()
    assert main(["plugins"]) == 0
    assert "thirdparty" not in capsys.readouterr().out


def test_show_explains_every_option(installed: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    installed("good_one", lambda: [spec("thirdparty")])
    assert main(["plugins", "show", "thirdparty", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["source"] == __file__
    assert facts["options"] == [
        {"name": "radius_px", "type": "int", "default": 2, "meaning": "how far the window reaches.", "unit": "pixels"},
        {"name": "names", "type": "tuple[str, ...]", "default": [], "meaning": "two of a kind.", "unit": ""},
        {"name": "words", "type": "tuple[str, ...]", "default": ["a", "b"], "meaning": "two of a kind.", "unit": ""},
        {
            "name": "inner.eps_levels",
            "type": "float",
            "default": 8.0,
            "meaning": "how far a pixel may move.",
            "unit": "levels of 0..255",
        },
    ]
    assert main(["plugins", "show", "thirdparty"]) == 0
    out = capsys.readouterr().out
    assert "  radius_px: int = 2 [pixels]\n      how far the window reaches.\n" in out


@pytest.mark.parametrize(
    ("kind", "name", "flag", "command"),
    [
        ("task", "semseg", "--set options.KEY=VALUE", "collect"),
        ("model", "ddrnet23_slim", "--model-set KEY=VALUE", "evaluate"),
        ("attack", "eot", "--set KEY=VALUE", "attack"),
        ("defense", "jpeg", "--defense-set KEY=VALUE", "evaluate"),
        ("logger", "tensorboard", "--log-set KEY=VALUE", "train"),
    ],
)
def test_show_names_the_flag_that_the_commands_have(
    kind: str, name: str, flag: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plugins", "show", name, "--kind", kind]) == 0
    assert f"options ({flag}" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert f"{flag.split()[0]} " in capsys.readouterr().out


def test_every_kind_of_plugin_states_how_its_options_are_set() -> None:
    assert tuple(OPTION_FLAGS) == KINDS


def test_show_knows_the_built_in_tasks_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plugins", "show", "semseg", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    by_name = {option["name"]: option for option in facts["options"]}
    assert by_name["hfov_deg"]["meaning"].startswith("horizontal field of view")
    assert by_name["labels.coarse_window_px"]["default"] == 9
    assert all(option["meaning"] for option in facts["options"])
    assert facts["source"].endswith("semseg.py")


def test_an_unknown_name_says_what_was_meant_and_what_failed(
    installed: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("bad", fails)
    assert main(["plugins", "show", "semsegg"]) == 2
    assert capsys.readouterr().err == (
        "gear: no plugin named 'semsegg'; did you mean semseg? (1 plugin(s) failed to load: bad; see `gear plugins`)\n"
    )
    assert main(["plugins", "show"]) == 2
    assert "needs a name" in capsys.readouterr().err


def test_a_name_of_two_kinds_asks_which(installed: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    installed("good_one", lambda: [spec("semseg")])
    assert main(["plugins", "show", "semseg"]) == 2
    assert "add --kind task or --kind defense" in capsys.readouterr().err
    assert main(["plugins", "show", "semseg", "--kind", "defense"]) == 0
