"""How a scene's patch is made and measured: pictures, seeds, and the gear commands in their order.

Training pictures, those that choose among steps, and those that the effect is measured on have seeds of their own, from
40000, 41000 and 42000 on: nobody else's, neither the paper's nor those of the reference weights.
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
"""Of the first scene's splits; every further scene has the next ones."""

SAMPLES = {"train": 24, "val": 4, "test": 24}
SAMPLES_OF = {"stereo3d": {"train": 24, "val": 4, "test": 40}}
"""Of tasks whose pictures say less each: in many pictures a patch can reach few cars."""

STEPS = 120
STEPS_OF = {"detect2d": 150, "stereo3d": 150}
"""Of tasks whose networks need more to give in."""

PRECISION = "float32"
"""Of an attack's passes, where nothing else is said."""

EVERY = 25
"""Steps between two looks at the validation pictures."""

PICTURES: dict[str, tuple[str, ...]] = {
    "semseg": ("quality=fast",),
    "depth": ("quality=fast",),
    "stereo3d": ("quality=fast", f"crowd={5 / 3:g}"),
}
"""Settings of a task's pictures beside those of training: what costs most is rendered as `fast`, which networks know,
and a test of which cars are found wants cars within a patch's reach."""

_LEFT_OUT = tuple(f"losses.{name}=0" for name in ("sides", "centre", "size", "hidden", "surface", "disparity_bins"))

ATTACK: dict[str, tuple[str, ...]] = {"stereo_centre": _LEFT_OUT, "stereo_centre_lite0": _LEFT_OUT}
"""Options of the attack on a network: every loss is a backward pass of its own, and three of nine say what matters."""

TASK = "task"
"""Report of the task's own evaluator."""

OUTSIDE = {
    "semseg": ("outside_patch", "miou"),
    "depth": ("outside_patch", "eigen_d1"),
    "detect2d": (TASK, "found_share"),
    "stereo3d": (TASK, "found_share"),
}
"""Report and figure of single samples by which a patch's harm outside itself is tested. A board has no labelled objects
on it, so the share of objects that are found is such a figure as it is."""


EFFECT = {"stereo3d": "car_2d_moderate_r40"}
"""Figure of a task's own evaluator by which digital harm is compared with rendered, where it is not the task's figure:
the reference report's counts near cars alone, of which a scene's pictures have few."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One gear command.

    Attributes:
        name: of what it makes.
        arguments: of `gear`.
    """

    name: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchPlan:
    """One scene's patch.

    Attributes:
        task, model: whom it is made against.
        town, scene: where.
        number: of the scene among all of them; decides the seeds.
        samples: pictures by split.
        steps: of the attack.
        settings: `--set` texts of the collections.
        model_settings: `KEY=VALUE` texts of the model's options.
        attack_settings: of the attack's.
        precision: of the network's passes in the attack; figures are taken in float32.
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
        """Town and scene; a town that is given as a file has the file's name."""
        return f"{Path(self.town).stem}-{self.scene}"

    @property
    def name(self) -> str:
        """Of the patch: what `gear collect --patch` takes once it is installed."""
        return f"{self.model}-{self.place}"

    @property
    def figure(self) -> tuple[str, str]:
        """The task's own figure: the report that it is of, and its name."""
        spec = find("task", self.task).spec
        assert isinstance(spec, TaskSpec)
        report, _, name = spec.metric.rpartition(".")
        return report or TASK, name

    def seed(self, split: str) -> int:
        """Of a split."""
        return FIRST_SEEDS[split] + self.number

    def commands(self, root: Path) -> list[Step]:
        """What makes the patch in `root/<name>` and measures it on pictures that it was not made on."""
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
        """What measures the installed patch on pictures that it was not made on."""
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
    """The patches of a network, at the size that it was trained at.

    Args:
        task: name of the task.
        model: of the network.
        towns: to make them in.
        scenes: the names of those that are wanted; all with a board or the truck unless given.
        samples: pictures that each patch is made on, and as many that it is measured on.
        steps: of each attack; the task's usual number unless given.
        weights: as the networks' option of that name.
        settings: further `KEY=VALUE` texts of the collections.
        attack_settings: of the attack.
        precision: of the network's passes in it.

    Raises:
        GearError: there is no such task, model, town, scene or weights file, or the model does another task.
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
    """Names of a town's scenes that have a surface for a patch."""
    library = read_node(SceneLibrary, parse_file(find_config("scenes", town)))
    return [name for name, scene in library.scenes.items() if scene.boards or scene.truck is not None]


def model_settings(task: str, model: str, weights: str, settings: Iterable[str]) -> tuple[str, ...]:
    """What the network must be told: which weights, and at which share of these pictures' size it runs.

    Weights say at which share of the task's own pictures they are used. Smaller pictures are to be seen at a larger
    share, or the network would see them smaller than it ever did.

    Raises:
        GearError: there are no such weights.
    """
    options = find("model", model).spec.config()
    if not hasattr(options, "weights"):
        return ()
    said = trained_option(weights, model, "input_scale")
    told = () if weights == SHIPPED else (f"weights={weights}",)
    share = picture_share(task, settings)
    if not isinstance(said, (int, float)) or share == 1 or getattr(options, "input_scale", 1.0) is not None:
        return told
    return (*told, f"input_scale={said / share:.6g}")


def picture_share(task: str, settings: Iterable[str]) -> float:
    """Width of pictures collected with these settings, as a share of the width that the task has by itself."""
    spec = find("task", task).spec
    assert isinstance(spec, TaskSpec)
    own = [text.removeprefix("options.") for text in settings if text.startswith("options.")]
    config, usual = read_node(spec.config, with_overrides(NO_OPTIONS, own), ""), spec.config()
    return width_share(config.width_px, usual.width_px)


def _step(command: str, *words: object, name: str = "") -> Step:
    return Step(name=name or command, arguments=(command, *map(str, words)))


def _repeated(flag: str, texts: Iterable[str]) -> list[str]:
    return [word for text in texts for word in (flag, text)]
