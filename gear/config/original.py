"""CARLA-GeAR's own collection configs, accepted as they are; and its simulation config, read without running it.

Keys and their meaning: the template files of the original tool (`basepath`, `root`, `town_name`, `weather`, `task`,
`split`, `billboard`, `patch_folder`, `patch_type`, `net`, `debug`).
"""

from __future__ import annotations

import ast
from pathlib import Path

from gear.config.nodes import Mapping, Node, Place, Scalar
from gear.values.errors import ConfigError

ORIGINAL_KEYS = frozenset(
    (
        "basepath",
        "root",
        "town_name",
        "weather",
        "task",
        "split",
        "billboard",
        "patch_folder",
        "patch_type",
        "net",
        "debug",
    )
)
ORIGINAL_ONLY = frozenset(("basepath", "town_name", "billboard", "patch_folder"))
TASKS = {"ss": "semseg", "2dod": "detect2d", "3dod": "stereo3d", "depth": "depth"}
TOWNS = {"Town10HD": "town10", "Town10HD_Opt": "town10"}


def is_original(node: Node) -> bool:
    """Whether this is a config of the original tool."""
    return isinstance(node, Mapping) and bool(ORIGINAL_ONLY & node.entries.keys())


def from_original(node: Mapping) -> Mapping:
    """The same wishes as a collection config of gear's. Its files lie under `basepath/root/billboard`, as they did.

    Raises:
        ConfigError: a key is neither the original's nor can be understood, or its task is none of the four.
    """
    for name, (place, _) in node.entries.items():
        if name not in ORIGINAL_KEYS:
            known = ", ".join(sorted(ORIGINAL_KEYS))
            raise place.error(name, f"unknown key in a CARLA-GeAR config (there are: {known})")
    entries: dict[str, tuple[Place, Node]] = {}

    def keep(name: str, text: str, source: str) -> None:
        place, item = node.entries[source]
        entries[name] = (place, Scalar(text, False, item.place))

    task = _text(node, "task")
    if task is None:
        raise node.place.error("task", "missing (one of ss, 2dod, 3dod, depth)")
    if task not in TASKS:
        raise node.entries["task"][1].place.error("task", f"expected one of {', '.join(TASKS)}, got {task!r}")
    keep("task", TASKS[task], "task")
    town = _text(node, "town_name")
    if town is not None:
        keep("town", TOWNS.get(town, town), "town_name")
    for name, source in (("split", "split"), ("scene", "billboard"), ("patch", "patch_folder"), ("weather", "weather")):
        text = _text(node, source)
        if text is not None:
            keep(name, text, source)
    root = Path(_text(node, "basepath") or ".") / (_text(node, "root") or task) / (_text(node, "billboard") or "")
    keep("root", str(root), "root" if "root" in node.entries else "task")
    return Mapping(entries, node.place)


def _text(node: Mapping, key: str) -> str | None:
    if key not in node.entries:
        return None
    place, item = node.entries[key]
    if not isinstance(item, Scalar):
        raise place.error(key, "expected one word or path")
    return None if item.is_null else item.text


def simulation_from_python(path: Path) -> str:
    """The original's `simulation_configs.py` as the YAML of gear's simulation config. Nothing of it is run.

    Only plain assignments of literals are understood (`SEED_VALUES`, `ITERATION_VALUES`, `MAX_VEHICLE_NPC`,
    `MAX_WALKER_NPC`); everything else in the file is passed over.

    Raises:
        ConfigError: the file is not Python, or one of those four is computed instead of written; the text to write in
            its place is in the message.
    """
    wanted: dict[str, object] = {}
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(path, 0, 0, "", f"cannot read it: {error}") from error
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None) or 0
        raise ConfigError(path, line, 1, "", "is not Python; write a YAML simulation config instead") from error
    for statement in tree.body:
        if not (isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name)):
            continue
        name = statement.targets[0].id
        if name not in ("SEED_VALUES", "ITERATION_VALUES", "MAX_VEHICLE_NPC", "MAX_WALKER_NPC"):
            continue
        try:
            wanted[name] = ast.literal_eval(statement.value)
        except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError) as error:
            problem = (
                "is computed, and gear runs no configs; write it as YAML: `splits: {test: {seed: 363, samples: 50}}`"
            )
            raise ConfigError(path, statement.lineno, statement.col_offset + 1, name, problem) from error
    return _simulation_yaml(path, wanted)


def _simulation_yaml(path: Path, wanted: dict[str, object]) -> str:
    seeds, counts = wanted.get("SEED_VALUES"), wanted.get("ITERATION_VALUES")
    if not (isinstance(seeds, dict) and isinstance(counts, dict)):
        raise ConfigError(
            path, 0, 0, "", "has no SEED_VALUES and ITERATION_VALUES; is it a CARLA-GeAR simulation config?"
        )
    lines = ["splits:"]
    for split in seeds:
        if split in counts:
            drive = ", frames: 105" if split == "video" else ""
            lines.append(f"  {split}: {{seed: {seeds[split]}, samples: {counts[split]}{drive}}}")
    for name, key in (("MAX_VEHICLE_NPC", "max_vehicles"), ("MAX_WALKER_NPC", "max_pedestrians")):
        if name in wanted:
            lines.append(f"{key}: {wanted[name]}")
    return "\n".join(lines) + "\n"
