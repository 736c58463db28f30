"""Opens and checks all inputs of an attack before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.attacks import WithInputFiles
from gear.contracts.specs import AttackSpec
from gear.dataset.files import sha256
from gear.dataset.json_text import dump_json
from gear.dataset.reading import Dataset, scenes_of
from gear.dataset.store import plan_of, splits_of
from gear.measuring.guard import OpenedGuard, open_guard
from gear.measuring.plugin_selection import Chosen
from gear.plugins.attacks.optimisation.model_group import DefenseWeights
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.datasets import root_and_split, roots_of
from gear.readers import open_all
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks
from gear.values.serial import Json
from gear.verbs.attack.data import check_joined
from gear.verbs.attack.models import check_attack, check_gradient, choose_models
from gear.verbs.attack.request import AttackRequest

STEPS = 300
"""Number of steps if the user gives neither steps nor queries."""

TRAINING = ("train", "finetuning", "debug")
VALIDATION = ("val",)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Job:
    """All inputs of an attack, opened and checked.

    Attributes:
        datasets, validation: datasets on which patches are optimised, and datasets on which patches are validated.
        task: name of the task of all datasets.
        surfaces: number of patch surfaces in each sample, which is the number of patches.
        models: the attacked models.
        guard: the defense that the attack takes into account, with its calibration data.
        found, spec: plugin of the attack and its spec.
        options, config: options of the attack, as the user gave them and as a config object.
        compositor: name of the compositor that puts patches into pictures.
        steps, queries: largest number of optimisation steps, and of forward passes (None: not limited).
        every, patience: steps between two validations, and number of validations without improvement after which the
            attack stops (0: never).
        seed: seed of all random draws.
        weights: weights of the loss terms that lower the defense's score and mask.
    """

    datasets: Sequence[Dataset[Any]]
    validation: Sequence[Dataset[Any]]
    task: str
    surfaces: int
    models: Sequence[Chosen]
    guard: OpenedGuard
    found: PluginEntry
    spec: AttackSpec[Any]
    options: Node
    config: Any
    compositor: str
    steps: int
    queries: int | None
    every: int
    patience: int
    seed: int
    weights: DefenseWeights

    def plan(self, weights_sha256: str | None, product: Any) -> Json:
        """Returns everything on which the patches depend, as JSON; a later run with an equal plan reuses the
        patches.

        Args:
            weights_sha256: hash of the weights of the attacked networks.
            product: the attack object, which may name the hash of the files that it reads.
        """
        learnt = self.guard.calibration
        read = product.read_sha256() if isinstance(product, WithInputFiles) else None
        return {
            "attack": {
                "name": self.spec.name,
                "package": self.found.owner.package,
                "version": self.found.owner.version,
                "options": to_plain(self.config),
                **({} if read is None else {"read_sha256": read}),
            },
            "models": [one.facts() for one in self.models],
            "weights_sha256": weights_sha256,
            "defense": None if self.guard.defense is None else self.guard.defense.facts(),
            **({} if learnt.clean is None else {"calibration": learnt.facts()}),
            **learnt.counted(),
            **({} if self.guard.defense is None else {"defense_weights": to_plain(self.weights)}),
            "task": self.task,
            "data": [_facts(dataset) for dataset in self.datasets],
            "validation": [_facts(dataset) for dataset in self.validation],
            "compositor": self.compositor,
            "steps": self.steps,
            "queries": self.queries,
            "every": self.every,
            "patience": self.patience,
            "seed": self.seed,
        }


def resolve(request: AttackRequest, callbacks: Callbacks) -> Job:
    """Opens and checks everything that a request names: datasets, models, defense and attack.

    Args:
        request: the arguments of `gear.attack`.
        callbacks: called while the defense is calibrated.

    Raises:
        GearError: something does not exist, or two inputs do not fit together.
    """
    allowed = request.allow_test_data
    datasets = open_all(request.data, _task_of(request.data), names=TRAINING, allow_test_data=allowed)
    task = datasets[0].plan.task["name"]
    validation = open_all(request.val, task, names=VALIDATION, allow_test_data=allowed)
    everything = [*datasets, *validation]
    check_joined(everything)
    models = choose_models(request.models, request.model_settings, everything)
    found, options = find("attack", request.attack), with_overrides(NO_OPTIONS, request.settings)
    config = read_node(found.spec.config, options, "")
    surfaces = len(datasets[0].sidecar(0).record.surfaces)
    spec = check_attack(found, models, task, surfaces, request.queries)
    guard = open_guard(request.guard, models, task, callbacks=callbacks)
    check_gradient(guard.defense, spec)
    if {scenes_of(one) for one in datasets} & {scenes_of(one) for one in validation}:
        raise GearError("--data and --val hold the same samples; give --val another split")
    steps, queries = request.steps, request.queries
    if steps is None:
        steps = STEPS if queries is None else queries  # a step costs at least one query
    return Job(
        datasets=datasets,
        validation=validation,
        task=task,
        surfaces=surfaces,
        models=models,
        guard=guard,
        found=found,
        spec=spec,
        options=options,
        config=config,
        compositor=_usable(request.compositor, spec, everything),
        steps=steps,
        queries=queries,
        every=request.every,
        patience=request.patience,
        seed=request.seed,
        weights=DefenseWeights(score=request.score_weight, mask=request.mask_weight),
    )


def _usable(compositor: str, spec: AttackSpec[Any], datasets: Sequence[Dataset[Any]]) -> str:
    """Returns the name of the compositor: the requested one, or `homography` if `transport` cannot be used.

    `transport` needs probes, samples rendered with each surface black and white. Only attacks that do not require
    probes switch to `homography`.

    Raises:
        DatasetError: the attack requires probes and a dataset has none.
    """
    lacking = next((dataset for dataset in datasets if not dataset.plan.auxiliary), None)
    if compositor != "transport" or lacking is None:
        return compositor
    if spec.needs_probes:
        raise DatasetError(
            lacking.root, "has no probes; collect it with --probes, or attack with --compositor homography"
        )
    return "homography"


def _facts(dataset: Dataset[Any]) -> Json:
    info = dataset.plan.info
    return {
        "scene": f"{info.town}/{info.scene}",
        "split": info.split,
        "seed": info.seed,
        "weather": dataset.named("weather"),
        "samples": len(dataset),
        "content": dataset.plan.content_key,
        "sha256": sha256(dump_json(dataset.manifest["samples"])),
    }


def _task_of(data: Sequence[str | Path]) -> str:
    """Returns the task of the first dataset that the paths refer to.

    Raises:
        DatasetError: there is no dataset, or the dataset does not record its task.
    """
    for path in data:
        for root in roots_of(root_and_split(path)[0]):
            return plan_of(root, splits_of(root)[0]).task["name"]
    raise DatasetError(str(next(iter(data), "")), "there is no dataset of gear's here")
