"""What is attacked, with what and how: everything chosen and checked before anything is made."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
from gear.dataset.reading import Dataset, scenes_of
from gear.dataset.sidecar import dump_json
from gear.dataset.store import plan_of, splits_of
from gear.measuring.calibration import Calibration, opened_calibration
from gear.measuring.plugin_selection import Chosen
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.datasets import root_and_split, roots_of
from gear.readers import open_all
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Progress
from gear.values.rng import check_seed
from gear.values.serial import Json
from gear.verbs.attack.data import check_joined
from gear.verbs.attack.models import FLAG, check_attack, choose_defense, choose_models

STEPS = 300
"""Where neither steps nor queries are given."""

TRAINING = ("train", "finetuning", "debug")
VALIDATION = ("val",)

Paths = str | Path | Sequence[str | Path]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Job:
    """An attack that can be made.

    Attributes:
        datasets, validation: on whose samples patches are optimised, and judged.
        task: of both.
        surfaces: of each sample: so many patches are made.
        models, defense: what is attacked, and what the attack looks through.
        calibration: what the defense learns from.
        found, spec: the attack.
        options, config: of it, as given and as read.
        compositor: by name.
        steps, queries: the budget.
        every, patience: steps between validations, and validations without a better one until the end.
        seed: of everything that is drawn.
    """

    datasets: Sequence[Dataset[Any]]
    validation: Sequence[Dataset[Any]]
    task: str
    surfaces: int
    models: Sequence[Chosen]
    defense: Chosen | None
    calibration: Calibration
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

    def plan(self, weights_sha256: str | None, product: Any) -> Json:
        """What decides the patches: who gives the same finds them made. Weights are those of the built network."""
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
            "defense": None if self.defense is None else self.defense.facts(),
            **({} if self.calibration.clean is None else {"calibration": self.calibration.facts()}),
            **self.calibration.counted(),
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


def resolve(
    data: Paths,
    *,
    model: str | Sequence[str],
    attack: str,
    steps: int | None,
    queries: int | None,
    settings: Iterable[str],
    model_settings: Iterable[str],
    defense: str | None,
    defense_settings: Iterable[str],
    calibration: str | Path | None,
    calibration_patched: str | Path | None,
    on_fit_progress: Progress | None,
    val: Paths,
    every: int,
    patience: int,
    compositor: str,
    seed: int,
    allow_test_data: bool,
) -> Job:
    """Opens, finds and checks what `gear.attack` was given; see there.

    Raises:
        GearError: it is not there, or does not fit together.
    """
    check_seed(seed)
    if (steps is not None and steps < 1) or every < 1 or patience < 0 or (queries is not None and queries < 1):
        raise GearError("steps, queries and every must be at least 1, patience at least 0")
    if patience and not _list(val):
        raise GearError("patience counts looks at validation samples, and there are none: name some with --val")
    datasets = open_all(_list(data), _task_of(data), names=TRAINING, allow_test_data=allow_test_data)
    task = datasets[0].plan.task["name"]
    validation = open_all(_list(val), task, names=VALIDATION, allow_test_data=allow_test_data)
    check_joined([*datasets, *validation])
    models = choose_models([model] if isinstance(model, str) else list(model), model_settings, [*datasets, *validation])
    found, options = find("attack", attack), with_overrides(NO_OPTIONS, settings)
    config = read_node(found.spec.config, options, "")
    surfaces = len(datasets[0].sidecar(0).record.surfaces)
    spec = check_attack(found, models, task, surfaces, queries)
    learnt = opened_calibration(
        calibration, calibration_patched, models, defense, flag=FLAG, on_fit_progress=on_fit_progress
    )
    guard = choose_defense(
        defense,
        defense_settings,
        models,
        task,
        is_calibrated=learnt.clean is not None,
        needs_gradients=spec.needs_gradients,
    )
    if {scenes_of(one) for one in datasets} & {scenes_of(one) for one in validation}:
        raise GearError("--data and --val hold the same samples; give --val another split")
    if steps is None:
        steps = STEPS if queries is None else queries  # a step costs at least one
    return Job(
        datasets=datasets,
        validation=validation,
        task=task,
        surfaces=surfaces,
        models=models,
        defense=guard,
        calibration=learnt,
        found=found,
        spec=spec,
        options=options,
        config=config,
        compositor=_usable(compositor, spec, [*datasets, *validation]),
        steps=steps,
        queries=queries,
        every=every,
        patience=patience,
        seed=seed,
    )


def _usable(compositor: str, spec: AttackSpec[Any], datasets: Sequence[Dataset[Any]]) -> str:
    """The one that is asked for; homography where transport lacks probes that the attack does not need.

    Raises:
        DatasetError: the attack needs them.
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


def _task_of(data: Paths) -> str:
    """The task of the first dataset that the paths mean.

    Raises:
        DatasetError: there is none, or it does not say its task.
    """
    for path in _list(data):
        for root in roots_of(root_and_split(path)[0]):
            return plan_of(root, splits_of(root)[0]).task["name"]
    raise DatasetError(str(next(iter(_list(data)), "")), "there is no dataset of gear's here")


def _list(paths: Paths) -> list[str | Path]:
    return [paths] if isinstance(paths, (str, Path)) else list(paths)
