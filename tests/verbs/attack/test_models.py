"""Checks of attacks against models, defenses and budgets."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from gear.measuring.plugin_selection import chosen_defense
from gear.plugins.build import find
from gear.values.errors import GearError
from gear.verbs.attack.models import check_attack, check_gradient, choose_models


def attack(name: str, **changes: Any) -> Any:
    found = find("attack", name)
    return replace(found, spec=replace(found.spec, **changes))


def model(*, has_gradients: bool = True) -> Any:
    found = find("model", "ddrnet23_slim")
    return SimpleNamespace(found=replace(found, spec=replace(found.spec, has_gradients=has_gradients)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("found", "surfaces", "gradients", "queries", "message"),
    [
        (attack("scene_specific", tasks=("depth",)), 1, True, None, "is for depth; this is a semseg dataset"),
        (attack("scene_specific", max_surfaces=1), 2, True, None, "makes up to 1 patches; the scene has 2 surfaces"),
        (attack("scene_specific"), 1, False, None, "needs gradients; model 'ddrnet23_slim' gives none"),
        (attack("scene_specific"), 1, True, 100, "takes steps; --queries is for attacks without gradients"),
        (attack("square"), 1, False, None, "say how many with --queries N"),
    ],
)
def test_what_does_not_fit_is_named(
    found: Any, surfaces: int, gradients: bool, queries: int | None, message: str
) -> None:
    with pytest.raises(GearError, match=message):
        check_attack(found, [model(has_gradients=gradients)], "semseg", surfaces, queries)


def test_what_fits_gives_the_spec() -> None:
    assert check_attack(attack("scene_specific"), [model()], "semseg", 1, None).name == "scene_specific"
    assert check_attack(attack("square"), [model(has_gradients=False)], "semseg", 1, 50).name == "square"


def test_a_defense_without_gradients_suits_only_attacks_without_them() -> None:
    defense = chosen_defense("median", ())
    assert defense is not None
    found = replace(defense.found, spec=replace(defense.found.spec, gradient="none"))  # type: ignore[call-arg]
    opaque = replace(defense, found=found)
    with pytest.raises(GearError, match="declares no gradient"):
        check_gradient(opaque, find("attack", "scene_specific").spec)  # type: ignore[arg-type]
    check_gradient(opaque, find("attack", "square").spec)  # type: ignore[arg-type]
    check_gradient(None, find("attack", "scene_specific").spec)  # type: ignore[arg-type]


def test_models_are_named_and_each_once() -> None:
    with pytest.raises(GearError, match="name a model to attack"):
        choose_models([], (), [])
    with pytest.raises(GearError, match="a model is named twice"):
        choose_models(["ddrnet23_slim", "ddrnet23_slim"], (), [])
