"""Specs are held to the type hints of their classes, and whatever is wrong is one printable line."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from gear.contracts.models import PublishedWeights, Recipe
from gear.contracts.specs import PROTOCOL_VERSION, SPEC_TYPES, DefenseSpec, MetricSpec, ModelSpec, TaskSpec
from gear.plugins.manager import discover
from gear.plugins.spec_validation import COMMON_FIELDS, mismatch, spec_problem


@dataclass(frozen=True, kw_only=True)
class Config:
    radius_px: int = 2


@dataclass(frozen=True, kw_only=True)
class Needy:
    radius_px: int


@dataclass(frozen=True, kw_only=True)
class Refused:
    radius_px: int = 2

    def __post_init__(self) -> None:
        raise ValueError("never")


def nothing(config: Any) -> Any:
    return None


PLAIN: dict[str, Any] = {"name": "thirdparty", "summary": "Does nothing.", "config": Config, "build": nothing}
MODEL = PLAIN | {"tasks": (), "views": ("left",)}
METRIC = PLAIN | {"tasks": ("depth",), "metric": "rmse_m"}
PUBLISHED = PublishedWeights(data="d", source="s", licence="l", size_mb=9)


@pytest.mark.parametrize(
    ("facts", "problem"),
    [
        ({"tasks": {"depth"}}, "its tasks must be a tuple, got set"),
        ({"tasks": "depth"}, "its tasks must be a tuple, got str"),
        ({"tasks": None}, "its tasks must be a tuple, got NoneType"),
        ({"taps": ("stem", 1)}, "its taps[1] must be a str, got int"),
        ({"outputs": {"mask"}}, "its outputs must be a frozenset, got set"),
        (
            {"outputs": frozenset({"masks"})},
            "its outputs item must be one of 'images', 'mask', 'score', got 'masks'",
        ),
        ({"gradient": "exact"}, "its gradient must be one of 'differentiable', 'surrogate', 'none', got 'exact'"),
        ({"needs_model": 1}, "its needs_model must be a bool, got int"),
        ({"tasks": ("\x1b[31mred",)}, r"its tasks[0] must be one line of printable text, got '\x1b[31mred'"),
        ({"summary": "one\ntwo"}, "its summary is not one line"),
        ({"summary": "\x1b[2Jgone"}, "its summary is not one line"),
        ({"config": Refused}, "its own defaults are refused: ValueError: never"),
        ({"config": Needy}, "every option needs a default"),
        ({"config": Config()}, "its config is not a dataclass"),
        ({"build": 3}, "its build cannot be called"),
        ({"protocol": PROTOCOL_VERSION + 1}, None),
    ],
)
def test_a_defense_that_is_not_what_it_should_be(facts: dict[str, Any], problem: str | None) -> None:
    assert spec_problem("defense", DefenseSpec(**PLAIN)) is None
    found = spec_problem("defense", DefenseSpec(**(PLAIN | facts)))
    assert found == f"'thirdparty': {problem}" if problem else "speaks protocol 2, this gear speaks 1" in str(found)


@pytest.mark.parametrize(
    ("facts", "problem"),
    [
        ({"starts": None}, "its starts must be a Mapping, got NoneType"),
        ({"starts": {"imagenet": 1}}, "its starts['imagenet'] must be a function, got int"),
        ({"starts": {1: print}}, "its starts key must be a str, got int"),
        ({"published": None}, "its published must be a tuple, got NoneType"),
        ({"published": ("x",)}, "its published[0] must be a PublishedWeights, got str"),
        (
            {"published": (PublishedWeights(data="d", source="s", licence="l", size_mb="9"),)},  # type: ignore[arg-type]
            "its published[0].size_mb must be a float, got str",
        ),
        ({"recipe": "sgd"}, "its recipe must be a Recipe or None, got str"),
        ({"recipe": Recipe(optimiser="lion")}, "its recipe.optimiser must be one of 'adamw', 'sgd', got 'lion'"),  # type: ignore[arg-type]
        ({"recipe": Recipe(crop_px=(1, 2, 3))}, "its recipe.crop_px must hold 2 values, got 3"),  # type: ignore[arg-type]
        ({"convert": "keys"}, "its convert must be a function or None, got str"),
        ({"input_scale": "half"}, "its input_scale must be a float, got str"),
        ({"input_scale": True}, "its input_scale must be a float, got bool"),
        ({"parameters": True}, "its parameters must be an int, got bool"),
        ({"needs": None}, "its needs must be a tuple, got NoneType"),
    ],
)
def test_a_model_that_is_not_what_it_should_be(facts: dict[str, Any], problem: str) -> None:
    good = {"recipe": Recipe(), "published": (PUBLISHED,), "starts": {"imagenet": print}, "input_scale": 1}
    assert spec_problem("model", ModelSpec(**(MODEL | good))) is None
    assert spec_problem("model", ModelSpec(**(MODEL | facts))) == f"'thirdparty': {problem}"


@pytest.mark.parametrize(
    ("facts", "problem"),
    [
        ({"tasks": ()}, "its tasks are empty; name the tasks that it measures"),
        ({"unit": None}, "its unit must be a str, got NoneType"),
        ({"lower_is_better": "yes"}, "its lower_is_better must be a bool, got str"),
    ],
)
def test_a_metric_that_is_not_what_it_should_be(facts: dict[str, Any], problem: str) -> None:
    assert spec_problem("metric", MetricSpec(**METRIC)) is None
    assert spec_problem("metric", MetricSpec(**(METRIC | facts))) == f"'thirdparty': {problem}"


class Shouting(str):
    def __repr__(self) -> str:
        raise RuntimeError("no repr")


@pytest.mark.parametrize("name", ["Bad Name", "", 3, "\x1b]0;title\x07", Shouting("quiet")])
def test_a_name_that_is_none_is_one_printable_line(name: Any) -> None:
    problem = spec_problem("defense", DefenseSpec(**(PLAIN | {"name": name})))
    assert problem is not None and problem.isprintable()
    assert "is not a plugin's name" in problem or "no repr" in problem


def test_a_spec_of_another_kind_is_refused() -> None:
    wanted = "gear_models returns ModelSpec objects, got DefenseSpec"
    assert spec_problem("model", DefenseSpec(**PLAIN)) == wanted
    assert spec_problem("task", 3) == "gear_tasks returns TaskSpec objects, got int"


def test_every_field_of_every_kind_has_a_hint_that_is_checked() -> None:
    """An object that fits no hint is refused in place of each declared field."""
    examples = {"defense": DefenseSpec(**PLAIN), "model": ModelSpec(**MODEL), "metric": MetricSpec(**METRIC)}
    examples["task"] = TaskSpec(**PLAIN, views=("left",), layout="files")
    for kind, spec in examples.items():
        hints = typing.get_type_hints(SPEC_TYPES[kind])  # type: ignore[index]
        for name in hints.keys() - COMMON_FIELDS:
            changed = type(spec)(**{field: getattr(spec, field) for field in hints} | {name: object()})
            assert f"its {name} must be " in str(spec_problem(kind, changed)), (kind, name)  # type: ignore[arg-type]


def test_built_in_specs_pass() -> None:
    assert discover([]).broken == ()


def test_mappings_hold_what_they_say() -> None:
    assert mismatch({"a": 1}, Mapping[str, int], "weights") is None
    assert mismatch({"a": "1"}, Mapping[str, int], "weights") == "weights['a'] must be an int, got str"
