"""Reads the file of a scene library. A faulty scene does not prevent the use of the correct scenes in the file."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping as MappingType
from dataclasses import dataclass
from pathlib import Path

from gear.config.nodes import Mapping, Node, parse_file
from gear.config.reader import read_node
from gear.values.errors import ConfigError, UnknownNameError
from gear.world.scene_spec import SceneLibrary, SceneSpec


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SceneFile:
    """The scenes of one file: the valid scenes, and the errors of the faulty scenes.

    Attributes:
        library: the valid scenes; at least one.
        faulty: the error of each faulty scene, by the scene's name.
    """

    library: SceneLibrary
    faulty: MappingType[str, ConfigError]

    @property
    def scenes(self) -> MappingType[str, SceneSpec]:
        """The valid scenes of the file, by name."""
        return self.library.scenes

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all scenes in the file; faulty ones come last."""
        return (*self.library.scenes, *self.faulty)

    def scene(self, name: str) -> SceneSpec:
        """Returns the scene with this name.

        Args:
            name: name of the scene.

        Raises:
            ConfigError: that scene is faulty.
            UnknownNameError: there is no scene with this name.
        """
        if name in self.faulty:
            raise self.faulty[name]
        if name not in self.library.scenes:
            raise UnknownNameError(f"scene of {self.library.town}", name, self.names)
        return self.library.scenes[name]


def read_scene_file(path: Path) -> SceneFile:
    """Reads a scene library.

    Args:
        path: path of the YAML file.

    Raises:
        ConfigError: the file is not YAML, is no scene library, or none of its scenes can be read.
    """
    root = parse_file(path)
    faulty: dict[str, ConfigError] = {}
    if isinstance(root, Mapping) and "scenes" in root.entries:
        place, scenes = root.entries["scenes"]
        if isinstance(scenes, Mapping):
            for name, (_, node) in scenes.entries.items():
                if (error := _fault(name, node)) is not None:
                    faulty[name] = error
            if faulty and len(faulty) == len(scenes.entries):
                raise next(iter(faulty.values()))
            good = {name: entry for name, entry in scenes.entries.items() if name not in faulty}
            root = Mapping({**root.entries, "scenes": (place, dataclasses.replace(scenes, entries=good))}, root.place)
    return SceneFile(library=read_node(SceneLibrary, root), faulty=faulty)


def _fault(name: str, node: Node) -> ConfigError | None:
    try:
        read_node(SceneSpec, node, f"scenes.{name}")
    except ConfigError as error:
        return error
    return None
