"""From a file, flags and `--set` to the configs of one run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from gear.config.collection import CollectionConfig, SimulationConfig, SplitConfig
from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Node, Place, Scalar, parse_file, parse_text
from gear.config.original import from_original, is_original, simulation_from_python
from gear.config.overrides import merged, with_overrides
from gear.config.reader import read_node, spelled_out
from gear.values.errors import UnknownNameError
from gear.values.resources import data_dir


def find_config(kind: str, name: str) -> Path:
    """A config by name (`default` of `simulation`) or by path.

    Raises:
        UnknownNameError: neither a file nor a name that gear knows.
    """
    path = Path(name)
    if path.suffix in (".yml", ".yaml", ".py"):
        if path.is_file():
            return path
        raise UnknownNameError(f"{kind} config", name, hint="(that file does not exist)")
    folder = data_dir("configs") / kind
    found = folder / f"{name}.yml"
    if name and Path(name).name == name and found.is_file():
        return found
    raise UnknownNameError(f"{kind} config", name, (p.stem for p in folder.glob("*.yml")))


def load_collection(
    source: str | None, flags: Mapping[str, str | None], settings: Iterable[str] = ()
) -> CollectionConfig:
    """Reads a collection config.

    Args:
        source: name or path of a YAML file (gear's or the original tool's), or None.
        flags: texts by key, None where a flag was not given; they go before the file.
        settings: `KEY=VALUE` texts; they go before both.

    Raises:
        ConfigError: anything in it cannot be read; says where.
    """
    node: Node = MappingNode({}, Place("command line"))
    if source is not None:
        node = parse_file(find_config("collections", source))
        if isinstance(node, MappingNode) and is_original(node):
            node = from_original(node)
    given: dict[str, tuple[Place, Node]] = {
        key: (Place(f"--{key}"), Scalar(text, False, Place(f"--{key}")))
        for key, text in flags.items()
        if text is not None
    }
    node = merged(node, MappingNode(given, node.place))
    node = with_overrides(spelled_out(CollectionConfig, node), settings)
    if isinstance(node, MappingNode) and "task" not in node.entries:
        hint = "missing; say what to collect, such as --task stereo3d (see: gear plugins --kind task)"
        raise node.place.error("task", hint)
    return read_node(CollectionConfig, node)


def load_simulation(name: str) -> SimulationConfig:
    """Reads a simulation config by name or path; the original's `.py` without running it.

    Raises:
        ConfigError: it cannot be read.
    """
    path = find_config("simulation", name)
    node = parse_text(simulation_from_python(path), str(path)) if path.suffix == ".py" else parse_file(path)
    return read_node(SimulationConfig, node)


def split_of(simulation: SimulationConfig, split: str) -> SplitConfig:
    """The split's own entry, or that of the word before its first `_`.

    Raises:
        UnknownNameError: neither is there.
    """
    for name in (split, split.split("_")[0]):
        if name in simulation.splits:
            return simulation.splits[name]
    raise UnknownNameError("split", split, simulation.splits)
