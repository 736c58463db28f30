"""Loads the configs of a collection from a file, command-line flags and `--set`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from gear.config.collection import CollectionConfig, SimulationConfig, SplitConfig
from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Node, Place, Scalar, parse_file
from gear.config.original import from_original, is_original, original_root, simulation_from_python
from gear.config.overrides import merged, with_overrides, with_value
from gear.config.reader import read_node
from gear.values.errors import ConfigError, UnknownNameError
from gear.values.resources import data_dir


def find_config(kind: str, name: str) -> Path:
    """Finds a config file by path, or by name among the configs of one kind that come with gear.

    Args:
        kind: folder of the configs, such as `simulation` or `collections`.
        name: name such as `default`, or path of a file.

    Raises:
        UnknownNameError: there is neither a file nor a config of that name.
        ConfigError: the folder cannot be read.
    """
    path, folder = Path(name), data_dir("configs") / kind
    is_path = path.suffix in (".yml", ".yaml", ".py")
    found = path if is_path else folder / f"{name}.yml"
    try:
        is_there = found.is_file()
    except OSError as error:
        raise ConfigError(name, 0, 0, "", f"cannot read it: {error.strerror}") from error
    if is_there and (is_path or path.name == name):
        return found
    if is_path:
        hint = "(that is not a regular file)" if path.exists() else "(that file does not exist)"
        raise UnknownNameError(f"{kind} config", name, hint=hint)
    raise UnknownNameError(f"{kind} config", name, (p.stem for p in folder.glob("*.yml")))


def load_collection(
    source: str | None, flags: Mapping[str, str | None], settings: Iterable[str] = ()
) -> CollectionConfig:
    """Reads a collection config from a file, flags and settings.

    Args:
        source: name or path of a YAML file (gear's or CARLA-GeAR's); None without a file.
        flags: values of command-line flags by key, None for flags that were not given; they override the file.
        settings: `KEY=VALUE` texts; they override the file and the flags.

    Raises:
        ConfigError: a value cannot be read; the error names its file, line and column.
    """
    node: Node = MappingNode({}, Place("command line"))
    original: MappingNode | None = None
    if source is not None:
        node = parse_file(find_config("collections", source))
        if isinstance(node, MappingNode) and is_original(node):
            original, node = node, from_original(node)
        if not isinstance(node, MappingNode):
            return read_node(CollectionConfig, node)  # says what is wrong, which flags would cover up
    given: dict[str, tuple[Place, Node]] = {
        key: (Place(f"--{key}"), Scalar(text, False, Place(f"--{key}")))
        for key, text in flags.items()
        if text is not None
    }
    node = merged(node, MappingNode(given, node.place))
    node = with_overrides(node, settings, CollectionConfig)
    if original is not None and isinstance(node, MappingNode) and "root" not in node.entries:
        node = with_value(node, ("root",), original_root(original, node))
    if isinstance(node, MappingNode) and "task" not in node.entries:
        hint = "missing; say what to collect, such as --task stereo3d (see: gear plugins --kind task)"
        raise node.place.error("task", hint)
    return read_node(CollectionConfig, node)


def load_simulation(name: str) -> SimulationConfig:
    """Reads a simulation config by name or path; a Python file of CARLA-GeAR is parsed without running it.

    Args:
        name: name of a simulation config of gear, such as `default`, or path of a YAML or Python file.

    Raises:
        UnknownNameError: there is no such config.
        ConfigError: the file cannot be read.
    """
    path = find_config("simulation", name)
    return read_node(SimulationConfig, simulation_from_python(path) if path.suffix == ".py" else parse_file(path))


def split_of(simulation: SimulationConfig, split: str) -> SplitConfig:
    """The entry of a split in the simulation config, such as `test` for both `test` and `test_night`.

    A split without an entry of its own uses the entry of the word before the first `_` of its name.

    Args:
        simulation: the simulation config.
        split: name of the split.

    Raises:
        UnknownNameError: there is no such entry.
    """
    for name in (split, split.split("_")[0]):
        if name in simulation.splits:
            return simulation.splits[name]
    raise UnknownNameError("split", split, simulation.splits)
