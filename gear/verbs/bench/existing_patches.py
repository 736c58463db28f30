"""Patches that exist before a benchmark begins, and that it uses in place of an attack."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gear.config.reader import read_node
from gear.networks.options import SHIPPED
from gear.networks.shipped import shipped_patches
from gear.values.errors import GearError
from gear.verbs.bench.scenes import Scene
from gear.verbs.bench.validation import Candidate, TaskPlugins

PATCHES = "patches"
"""Folder of a benchmark with its patches, `<task>/<network>[+<defense>]/<scene>/patch_<n>.png`."""


class ExistingPatches:
    """The patches of a source, such as the weights packages or another benchmark."""

    def __init__(self, source: str) -> None:
        """Finds the source.

        Args:
            source: `shipped` for the patches of the installed weights packages, the folder of a benchmark, or empty for
                no patches.

        Raises:
            GearError: the folder does not exist, or is not that of a benchmark.
        """
        self._shipped: Mapping[str, Path] = shipped_patches() if source == SHIPPED else {}
        self._folder = Path(source) / PATCHES if source not in ("", SHIPPED) else None
        if self._folder is not None and not self._folder.is_dir():
            raise GearError(
                f"{source}: holds no patches of a benchmark; name the --out folder of a benchmark, or say {SHIPPED}"
            )

    def find(self, task_plugins: TaskPlugins, model: Candidate, name: str, scene: Scene) -> Path | None:
        """Returns the folder of a network's patches in a scene; None if the source does not have one for every surface.

        Shipped patches were made against shipped weights, so networks with other weights have none.

        Args:
            task_plugins: networks and defenses of the task.
            model: the attacked network.
            name: name of the network with its defense, or of the network alone, as `Plan.name` returns it.
            scene: the scene.
        """
        if self._folder is not None:
            folder: Path | None = self._folder / task_plugins.folder / name / scene.label
        elif name == model.label and _has_shipped_weights(model):
            folder = self._shipped.get(f"{model.plugin}-{scene.label}")
        else:
            folder = None
        if folder is None or not all((folder / f"patch_{n}.png").is_file() for n in range(scene.surfaces)):
            return None
        return folder


def _has_shipped_weights(model: Candidate) -> bool:
    options = read_node(model.chosen.found.spec.config, model.chosen.options, "")
    return getattr(options, "weights", None) == SHIPPED
