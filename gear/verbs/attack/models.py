"""Builds the model that is attacked: one network, several networks together, or networks guarded by a defense."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

from gear.contracts.defenses import Defense, DifferentiableDetector, FittedDefense
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec, DefenseSpec, ModelSpec
from gear.dataset.reading import Dataset
from gear.measuring.checked_defense import CheckedDefense
from gear.measuring.guard import OpenedGuard
from gear.measuring.plugin_selection import Chosen, check_model, chosen_model
from gear.plugins.attacks.optimisation.model_group import (
    USUAL_WEIGHTS,
    Cleaned,
    Defended,
    DefenseWeights,
    Group,
)
from gear.plugins.build import blamed, build
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import GearError
from gear.values.rng import derive_rng


def choose_models(names: Sequence[str], settings: Iterable[str], datasets: Sequence[Dataset[Any]]) -> list[Chosen]:
    """Finds the plugins of all models, with the same options for each, and checks that the models fit the datasets.

    Args:
        names: names of model plugins.
        settings: `KEY=VALUE` options, used for each model.
        datasets: the datasets that the models must fit.

    Returns:
        The models in the order of `names`.

    Raises:
        GearError: a model does not exist, an option does not fit, a model is named twice, or a model is for another
            task.
    """
    if not names:
        raise GearError("name a model to attack: --model NAME (gear plugins --kind model lists them)")
    chosen = [chosen_model(name, settings) for name in names]
    if len({one.found.full_name for one in chosen}) < len(names):
        raise GearError(f"a model is named twice: {', '.join(names)}")
    for model in chosen:
        for dataset in datasets:
            check_model(model, dataset)
    return chosen


def check_gradient(defense: Chosen | None, attack: AttackSpec[Any]) -> None:
    """Checks that the defense, if there is one, is differentiable where the attack needs gradients.

    Raises:
        GearError: the attack needs gradients and the defense passes none.
    """
    if defense is None:
        return
    spec = defense.found.spec
    assert isinstance(spec, DefenseSpec)
    if spec.gradient == "none" and attack.needs_gradients:
        raise GearError(
            f"defense {spec.name!r} declares no gradient, so an attack that needs one cannot look through it; attacks "
            "that count queries can (--attack square with --queries N)"
        )


def check_attack(
    plugin: PluginEntry, models: Sequence[Chosen], task: str, surfaces: int, queries: int | None
) -> AttackSpec[Any]:
    """Checks that the attack supports the task, the number of surfaces, the models and the budget; returns its spec.

    Args:
        plugin: plugin of the attack.
        models: the attacked networks.
        task: name of the task of the datasets.
        surfaces: number of patch surfaces in the scene.
        queries: the value of `--queries`, the largest number of forward passes; None if it is not given.

    Raises:
        GearError: the attack is for other tasks or for fewer surfaces, needs gradients that a model does not give, or
            `queries` is missing or not allowed for this attack.
    """
    spec = plugin.spec
    assert isinstance(spec, AttackSpec)
    if spec.tasks and task not in spec.tasks:
        raise GearError(f"attack {spec.name!r} is for {', '.join(spec.tasks)}; this is a {task} dataset")
    if surfaces > spec.max_surfaces:
        raise GearError(
            f"attack {spec.name!r} makes up to {spec.max_surfaces} patches; the scene has {surfaces} surfaces"
        )
    for model in models:
        assert isinstance(model.found.spec, ModelSpec)
        if spec.needs_gradients and not model.found.spec.has_gradients:
            raise GearError(f"attack {spec.name!r} needs gradients; model {model.found.spec.name!r} gives none")
    is_counted = not spec.needs_gradients and not spec.is_control
    if queries is not None and not is_counted:
        raise GearError(f"attack {spec.name!r} takes steps; --queries is for attacks without gradients")
    if is_counted and queries is None:
        raise GearError(f"attack {spec.name!r} is counted in forward passes: say how many with --queries N")
    return spec


def build_model(
    models: Sequence[Chosen], guard: OpenedGuard, seed: int, weights: DefenseWeights = USUAL_WEIGHTS
) -> Model:
    """Builds the model that is passed to `Attack.optimise`.

    A defense that needs calibration is calibrated for each model separately.

    Args:
        models: the attacked models.
        guard: the defense that the attack takes into account, with its calibration data.
        seed: seed of the calibration.
        weights: weights of the loss terms that lower the defense's score and mask.

    Raises:
        GearError: the defense neither changes pictures nor has a differentiable score or mask, so the attack could not
            take it into account.
    """
    built: dict[str, Model] = {}
    short = [chosen.found.spec.name for chosen in models]
    for chosen in models:
        model: Model = build(chosen.found, chosen.options)
        spec = chosen.found.spec
        assert isinstance(spec, ModelSpec)
        if guard.defense is not None:
            model = _behind(guard, model, spec.views, seed, weights)
        # Two packages may each have a network of the same name; both are attacked.
        built[spec.name if short.count(spec.name) == 1 else chosen.found.full_name] = model
    return next(iter(built.values())) if len(built) == 1 else Group(built)


def _behind(opened: OpenedGuard, model: Model, cameras: Sequence[str], seed: int, weights: DefenseWeights) -> Defended:
    """Wraps a model with a defense; the defense is calibrated when it is used for the first time."""
    defense, calibration = opened.defense, opened.calibration
    assert defense is not None
    product: Defense = build(defense.found, defense.options)
    spec = defense.found.spec
    assert isinstance(spec, DefenseSpec)
    with blamed(defense.found, "wrap"):
        wrapped = product.wrap(model)
    learn = partial(calibration.fit, defense, product, model, cameras, seed)
    guard = CheckedDefense(defense.found, product, model if spec.needs_model or spec.taps else None, learn)
    if wrapped is model and "images" not in spec.outputs and not isinstance(product, DifferentiableDetector):
        raise GearError(
            f"defense {spec.name!r} leaves pictures as they are and has no `defend_batch`, so an attack through it "
            "would be an attack without it (gear.contracts.defenses.DifferentiableDetector)"
        )
    if spec.gradient == "none":
        # The generator is seeded anew in each call, so the defense draws the same numbers every time.
        return Cleaned(
            wrapped,
            product,
            model,
            lambda views: guard.apply(views, derive_rng(0, "attack", spec.name), 0).views,
            calibrate=lambda: guard.state,
        )
    if isinstance(product, DifferentiableDetector):
        detecting = product
        return Defended(
            wrapped,
            product,
            model,
            detect=lambda views: detecting.defend_batch(views, model, guard.state),
            weights=weights,
            calibrate=lambda: guard.state,
        )
    if isinstance(product, FittedDefense):
        fitted = product
        return Defended(
            wrapped,
            product,
            model,
            lambda views: fitted.forward_fitted(views, model, guard.state),
            calibrate=lambda: guard.state,
        )
    return Defended(wrapped, product, model)
