"""How a scene's patch is made and measured: pictures, seeds, and the gear commands in their order.

The seeds of the pictures for the attack, for choosing among its steps, and for measuring start at 40000, 41000 and
42000. Neither the paper nor the training of the reference weights uses these seeds.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from authoring.weights.plan import TOWNS, TRAINING_OPTIONS
from gear.config.load import find_config
from gear.config.nodes import parse_file
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.evaluation import Maskable
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.networks.input_scale import width_share
from gear.networks.options import SHIPPED
from gear.networks.shipped import trained_option
from gear.plugins.build import NO_OPTIONS, build, find
from gear.values.errors import GearError, UnknownNameError
from gear.world.scene_spec import SceneLibrary

FIRST_SEEDS = {"train": 40_000, "val": 41_000, "test": 42_000}
"""Seeds of the splits of the first scene; they increase by 1 per scene."""

SAMPLES = {"train": 24, "val": 4, "test": 24}
SAMPLES_OF = {"stereo3d": {"train": 24, "val": 4, "test": 40}}
"""Samples for tasks that need more of them: in many pictures of `stereo3d`, a patch can influence few cars."""

STEPS = 120
STEPS_OF = {"detect2d": 150, "stereo3d": 150}
"""Steps of attacks on tasks that need more of them."""

PRECISION = "float32"
"""Default precision of the network in an attack."""

EVERY = 25
"""Steps between two validations."""

PICTURES: dict[str, tuple[str, ...]] = {
    "semseg": ("quality=fast",),
    "depth": ("quality=fast",),
    "stereo3d": ("quality=fast", f"crowd={5 / 3:g}"),
}
"""Settings of a task's pictures, in addition to those of its training data.

Expensive pictures are rendered as `fast`, a quality on which the networks were trained. More road users for `stereo3d`
give more cars that a patch can influence.
"""

_LEFT_OUT = tuple(f"losses.{name}=0" for name in ("sides", "centre", "size", "hidden", "surface", "disparity_bins"))

ATTACK: dict[str, tuple[str, ...]] = {"stereo_centre": _LEFT_OUT, "stereo_centre_lite0": _LEFT_OUT}
"""Options of the attack, by network. Each loss costs one backward pass, so six of nine losses are left out."""

TASK = "task"
"""Name of the report with the metrics of the task's evaluator."""

OUTSIDE = {
    "semseg": ("outside_patch", "miou"),
    "depth": ("outside_patch", "eigen_d1"),
    "detect2d": (TASK, "found_share"),
    "stereo3d": (TASK, "found_share"),
}
"""Report and per-sample metric by which the effect outside the patch is tested, by task.

A board shows no labelled objects, so the share of detected objects is a metric outside the patch.
"""


EFFECT = {"stereo3d": "car_2d_moderate_r40"}
"""Metric of the task's evaluator by which composed and rendered patches are compared, if it is not the task's metric.

The task's metric of `stereo3d` counts only near cars, and the pictures of one scene show few of them.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One gear command.

    Attributes:
        name: name of the step, for messages and times.
        arguments: arguments of `gear`.
    """

    name: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchPlan:
    """How the patch of one scene is made.

    Attributes:
        task, model: task and name of the attacked network.
        town, scene: place of the patch.
        number: number of the scene among all scenes; decides the seeds.
        samples: number of pictures by split.
        steps: steps of the attack.
        settings: values of `--set` for the collections.
        model_settings: `KEY=VALUE` texts of the model's options.
        attack_settings: `KEY=VALUE` texts of the attack's options.
        precision: precision of the network in the attack; evaluations use float32.
    """

    task: str
    model: str
    town: str
    scene: str
    number: int
    samples: dict[str, int] = dataclasses.field(default_factory=lambda: dict(SAMPLES))
    steps: int = STEPS
    settings: tuple[str, ...] = ()
    model_settings: tuple[str, ...] = ()
    attack_settings: tuple[str, ...] = ()
    precision: str = PRECISION

    @property
    def place(self) -> str:
        """Town and scene, `<town>-<scene>`; a town from a file is named by the file."""
        return f"{Path(self.town).stem}-{self.scene}"

    @property
    def name(self) -> str:
        """Name of the patch, for `gear collect --patch` after it is installed."""
        return f"{self.model}-{self.place}"

    @property
    def metric(self) -> tuple[str, str]:
        """The task's metric: name of its report, and name of the metric."""
        spec = find("task", self.task).spec
        assert isinstance(spec, TaskSpec)
        report, _, name = spec.metric.rpartition(".")
        return report or TASK, name

    def seed(self, split: str) -> int:
        """Returns the seed of a split."""
        return FIRST_SEEDS[split] + self.number

    def commands(self, root: Path) -> list[Step]:
        """Returns the steps that make the patch in `root/<name>` and measure it on other pictures."""
        patch = str(root / self.name)
        passes = () if self.precision == PRECISION else (f"precision={self.precision}",)
        return [
            self._collect("train", root / "train", probes=True),
            self._collect("val", root / "val", probes=True),
            _step(
                "attack", "--model", self.model, "--data", root / "train", "--val", root / "val", "--out", patch,
                "--steps", self.steps, "--every", min(EVERY, self.steps), *_repeated("--set", self.attack_settings),
                *_repeated("--model-set", (*self.model_settings, *passes)),
            ),
            *self._measurement(root, patch),
        ]  # fmt: skip

    def commands_again(self, root: Path) -> list[Step]:
        """Returns the steps that measure the installed patch on pictures that the attack did not use."""
        return self._measurement(root, self.name)

    def _measurement(self, root: Path, patch: str) -> list[Step]:
        model = _repeated("--set", self.model_settings)
        task = build(find("task", self.task), NO_OPTIONS)
        reports = ("reference", "outside_patch") if isinstance(task, Maskable) else ("reference",)
        return [
            self._collect("test", root / "none", probes=True),
            self._collect("test", root / "random", patch="random"),
            self._collect("test", root / "patched", patch=patch),
            _step(
                "evaluate", "--model", self.model, *model, *_repeated("--report", reports), "--out",
                root / "evaluation", "--data", root / "none", root / "random", root / "patched",
            ),
            _step(
                "gap", root / "none", "--twin", root / "patched", "--model", self.model, *model, "--compositor",
                "transport", "--out", root / "gap",
            ),
        ]  # fmt: skip

    def _collect(self, split: str, out: Path, *, probes: bool = False, patch: str = "none") -> Step:
        seed = self.seed(split)
        return _step(
            "collect", "--task", self.task, "--town", self.town, "--scene", self.scene, "--split", split,
            "--seed", seed, "--samples", self.samples[split], "--patch", patch, *["--probes"] * probes, "--out", out,
            *_repeated("--set", (*self.settings, f"patch_seed={seed}")), name=f"collect {out.name}",
        )  # fmt: skip


def plans(
    task: str,
    model: str,
    *,
    towns: Sequence[str] = TOWNS,
    scenes: Sequence[str] = (),
    samples: int | None = None,
    steps: int | None = None,
    weights: str = SHIPPED,
    settings: Iterable[str] = (),
    attack_settings: Iterable[str] = (),
    precision: str = PRECISION,
) -> list[PatchPlan]:
    """Returns the plans of a network's patches, with pictures of the size of its training data.

    Args:
        task: name of the task.
        model: name of the network.
        towns: names of the towns.
        scenes: names of the scenes; by default all scenes with a surface for a patch.
        samples: number of pictures for each attack, and as many for measuring; None for the task's default.
        steps: steps of each attack; None for the task's default.
        weights: value of the network's option `weights`.
        settings: further `KEY=VALUE` texts of the collections.
        attack_settings: `KEY=VALUE` texts of the attack's options.
        precision: precision of the network in the attack.

    Raises:
        GearError: an unknown task, model, town, scene or weights file, or a model of another task.
    """
    found = find("model", model).spec
    assert isinstance(found, ModelSpec)
    if task not in found.tasks:
        raise GearError(f"model {model!r} does {', '.join(found.tasks)}, not {task}")
    steps = STEPS_OF.get(task, STEPS) if steps is None else steps
    if steps < 1 or (samples is not None and samples < 1):
        raise GearError("samples and steps must be at least 1")
    chosen = (*TRAINING_OPTIONS[task], *PICTURES.get(task, ()), *settings)
    counts = SAMPLES_OF.get(task, SAMPLES)
    if samples is not None:
        counts = {"train": samples, "val": max(1, samples // 6), "test": samples}
    known = [(town, scene) for town in dict.fromkeys((*TOWNS, *towns)) for scene in patched_scenes(town)]
    here = [(number, place) for number, place in enumerate(known) if place[0] in towns]
    for scene in scenes:
        if scene not in [name for _, (_, name) in here]:
            raise UnknownNameError(f"scene of {', '.join(towns)}", scene, dict.fromkeys(name for _, (_, name) in here))
    return [
        PatchPlan(
            task=task,
            model=model,
            town=town,
            scene=scene,
            number=number,
            samples=dict(counts),
            steps=steps,
            settings=chosen,
            model_settings=model_settings(task, model, weights, chosen),
            attack_settings=(*ATTACK.get(model, ()), *attack_settings),
            precision=precision,
        )
        for number, (town, scene) in here
        if not scenes or scene in scenes
    ]


def patched_scenes(town: str) -> list[str]:
    """Returns the names of a town's scenes that have a surface for a patch."""
    library = read_node(SceneLibrary, parse_file(find_config("scenes", town)))
    return [name for name, scene in library.scenes.items() if scene.boards or scene.truck is not None]


def model_settings(task: str, model: str, weights: str, settings: Iterable[str]) -> tuple[str, ...]:
    """Returns the options of the network: its weights, and the factor by which it scales pictures of this size.

    A weights file names the factor for pictures of the task's default size. Smaller pictures need a larger factor, so
    that objects have the size that they had in the training.

    Args:
        task: name of the task.
        model: name of the network.
        weights: value of the network's option `weights`.
        settings: `KEY=VALUE` texts of the collections, which decide the size of pictures.

    Raises:
        GearError: the weights do not exist.
    """
    options = find("model", model).spec.config()
    if not hasattr(options, "weights"):
        return ()
    trained_scale = trained_option(weights, model, "input_scale")
    texts = () if weights == SHIPPED else (f"weights={weights}",)
    share = picture_share(task, settings)
    if not isinstance(trained_scale, (int, float)) or share == 1 or getattr(options, "input_scale", 1.0) is not None:
        return texts
    return (*texts, f"input_scale={trained_scale / share:.6g}")


def picture_share(task: str, settings: Iterable[str]) -> float:
    """Returns the width of pictures with these settings, divided by the task's default width."""
    spec = find("task", task).spec
    assert isinstance(spec, TaskSpec)
    own = [text.removeprefix("options.") for text in settings if text.startswith("options.")]
    config, usual = read_node(spec.config, with_overrides(NO_OPTIONS, own), ""), spec.config()
    return width_share(config.width_px, usual.width_px)


def _step(command: str, *words: object, name: str = "") -> Step:
    return Step(name=name or command, arguments=(command, *map(str, words)))


def _repeated(flag: str, texts: Iterable[str]) -> list[str]:
    return [word for text in texts for word in (flag, text)]
