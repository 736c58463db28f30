"""Dataset cards: the `README.md` files by which the Hugging Face hub and the package `datasets` describe a dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gear.contracts.tasks import SplitInfo
from gear.values.counted import counted
from gear.values.serial import Json

TASK_CATEGORIES = {
    "semseg": "image-segmentation",
    "detect2d": "object-detection",
    "stereo3d": "object-detection",
    "depth": "depth-estimation",
}
"""The Hugging Face hub's name for each of gear's tasks."""

SPLITS = {"val": "validation"}
"""Names of splits on the Hugging Face hub, by gear's names; only names that differ are listed."""

SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))

USES = "Training and evaluation of perception networks, of physical adversarial patches and of defenses against them."
LIMITS = (
    "Pictures are rendered. Streets, road users and textures are synthetic and few; what holds on them need not hold "
    "on photographs. Weather, light and traffic follow the configuration, not their frequency in a real country."
)
COLLECTION = (
    "Scenes are drawn from a seed, simulated and rendered with MuJoCo by gear. Ground truth is read off the renderer's "
    "buffers; no person labelled anything. Nothing in the data shows or describes a real person."
)

MIXED_DEVICES = "mixed"
"""Name of the device in the manifest of a split whose samples were rendered by different devices."""

MIXED_NOTE = (
    "Different graphics devices rendered the samples; the sidecar of each sample names its device. The same "
    "configuration does not give the same bytes again, and twins may differ in last bits outside the patch."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitFacts:
    """The metadata of one finished split that its dataset card states.

    Attributes:
        name: name of the split.
        task, town, scene, weather, patch, renderer: names.
        seed: random seed of the split.
        samples: number of samples.
        created: ISO date.
        gear, mujoco: versions of gear and of MuJoCo.
        has_mixed_devices: whether different graphics devices rendered the samples.
    """

    name: str
    task: str
    town: str
    scene: str
    weather: str
    patch: str
    renderer: str
    seed: int
    samples: int
    created: str
    gear: str
    mujoco: str
    has_mixed_devices: bool = False

    @property
    def hub_name(self) -> str:
        """The split's name on the Hugging Face hub, where `val` is called `validation`."""
        return SPLITS.get(self.name, self.name)

    @staticmethod
    def of(info: SplitInfo, task: str, samples: int, manifest: Json) -> SplitFacts:
        """The metadata of a split for its dataset card. A value that the manifest lacks becomes "unknown".

        Args:
            info: names of the split, town, scene and patch.
            task: name of the task.
            samples: number of samples.
            manifest: JSON of the manifest.
        """

        def at(key: str, inner: str) -> str:
            entry = manifest.get(key) if isinstance(manifest, dict) else None
            value = entry.get(inner) if isinstance(entry, dict) else None
            return value if isinstance(value, str) else "unknown"

        return SplitFacts(
            name=info.split,
            task=task,
            town=info.town,
            scene=info.scene,
            weather=at("weather", "name"),
            patch=info.patch_label,
            renderer=at("renderer", "name"),
            seed=info.seed,
            samples=samples,
            created=info.created,
            gear=at("versions", "gear"),
            mujoco=at("versions", "mujoco"),
            has_mixed_devices=at("renderer", "device") == MIXED_DEVICES,
        )


def title(splits: Sequence[SplitFacts]) -> str:
    """A readable title of the dataset, with task, town, scene and patch of its first split.

    Args:
        splits: the metadata of each split; at least one.
    """
    first = splits[0]
    return f"gear {first.task} {first.town} {first.scene}, patch {first.patch}"


def size_category(samples: int) -> str:
    """The Hugging Face hub's size category for a number of samples, such as `n<1K`.

    Args:
        samples: number of samples of all splits.
    """
    return next((name for most, name in SIZES if samples < most), "n>1M")


def card(splits: Sequence[SplitFacts], configs: Mapping[str, Mapping[str, Sequence[str]]], structure: str) -> str:
    """The Markdown text of a dataset card, with the YAML header that the Hugging Face hub reads.

    Args:
        splits: the metadata of each split; at least one.
        configs: glob patterns of the files of each split, by name of the Hugging Face configuration and by split.
        structure: Markdown text that describes the files.
    """
    first, samples = splits[0], sum(split.samples for split in splits)
    category = TASK_CATEGORIES.get(first.task)
    names = {split.name for split in splits}
    hub_names = {one.name: one.name if one.hub_name in names else one.hub_name for one in splits}
    lines = [
        "---",
        "license: mit",
        f"pretty_name: {json.dumps(title(splits))}",
        "language: [en]",
        "annotations_creators: [machine-generated]",
        "source_datasets: [original]",
        *([f"task_categories: [{category}]"] if category else []),
        f"size_categories: [{size_category(samples)}]",
        "tags: [synthetic, adversarial, autonomous-driving, croissant]",
        *(["configs:"] if configs else []),
    ]
    for place, (config, files) in enumerate(configs.items()):
        lines += [f"- config_name: {json.dumps(config)}", *(["  default: true"] if place == 0 else []), "  data_files:"]
        for split, patterns in files.items():
            quoted = ", ".join(json.dumps(pattern) for pattern in patterns)
            lines += [f"  - split: {json.dumps(hub_names[split])}", f"    path: [{quoted}]"]
    lines += ["---", "", f"# {title(splits)}", "", f"{counted(samples, 'sample')} of driving scenes, made by gear."]
    lines += ["", "| split | samples | town/scene | weather | patch | seed |", "|---|---|---|---|---|---|"]
    lines += [
        f"| {one.name} | {one.samples} | {one.town}/{one.scene} | {one.weather} | {one.patch} | {one.seed} |"
        for one in splits
    ]
    made = f"gear {first.gear}, MuJoCo {first.mujoco}, renderer {first.renderer}"
    lines += ["", "## Structure", "", structure, "", "## Creation", "", f"{COLLECTION} Versions: {made}."]
    if mixed := ", ".join(one.name for one in splits if one.has_mixed_devices):
        lines += ["", f"{MIXED_NOTE} Splits: {mixed}."]
    lines += ["", "## Uses", "", USES, "", "## Limits", "", LIMITS]
    lines += [
        "",
        "## Licence",
        "",
        "MIT, as gear and its assets. A patch, a town or an asset of another author keeps the licence of that author.",
        "",
    ]
    return "\n".join(lines)
