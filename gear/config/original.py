"""Reads CARLA-GeAR's own configs: its YAML collection config, and its Python simulation config without running it.

The keys and their meaning follow the template files of the original tool (`basepath`, `root`, `town_name`, `weather`,
`task`, `split`, `billboard`, `patch_folder`, `patch_type`, `net`, `debug`).
"""

from __future__ import annotations

import ast
from pathlib import Path

from gear.config.nodes import Mapping, Node, Place, Scalar, text_of
from gear.config.renamed import unknown_key
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
SIMULATION_NAMES = ("SEED_VALUES", "ITERATION_VALUES", "MAX_VEHICLE_NPC", "MAX_WALKER_NPC")
TABLES = SIMULATION_NAMES[:2]
READING_METHODS = frozenset(("copy", "get", "items", "keys", "values"))
READING_FUNCTIONS = frozenset(
    ("dict", "len", "list", "max", "min", "print", "repr", "set", "sorted", "str", "sum", "tuple")
)
"""Methods of dictionaries, and functions, that do not change the dictionary or their arguments."""

COMPUTED = "is computed, and gear runs no configs; write it as YAML: `splits: {test: {seed: 363, samples: 50}}`"
TASKS = {"ss": "semseg", "2dod": "detect2d", "3dod": "stereo3d", "depth": "depth"}
TOWNS = {"Town10HD": "town10", "Town10HD_Opt": "town10"}


def is_original(node: Node) -> bool:
    """Whether a parsed YAML file is a collection config of CARLA-GeAR, recognised by its keys.

    Args:
        node: the parsed file.
    """
    return isinstance(node, Mapping) and bool(ORIGINAL_ONLY & node.entries.keys())


def from_original(node: Mapping) -> Mapping:
    """Converts a collection config of CARLA-GeAR to gear's keys, without the dataset's folder (see
    `original_root`).

    Args:
        node: the config of CARLA-GeAR.

    Raises:
        ConfigError: a key is unknown, a value cannot be read, or the task is not `ss`, `2dod`, `3dod` or `depth`.
    """
    for name, (place, _) in node.entries.items():
        if name not in ORIGINAL_KEYS:
            problem = unknown_key(name, sorted(ORIGINAL_KEYS)).replace("key", "key in a CARLA-GeAR config", 1)
            raise place.error(name, problem)
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
    return Mapping(entries, node.place)


def original_root(node: Mapping, above: Mapping) -> Scalar:
    """The dataset's folder for a collection config of CARLA-GeAR: `basepath/root/billboard`, as in the original
    tool.

    Args:
        node: the config of CARLA-GeAR.
        above: the converted config with flags and settings applied, because another scene gets another folder.

    Raises:
        ConfigError: the scene or the task is not a single word.
    """
    task, scene = _text(above, "task") or "", _text(above, "scene") or ""
    words = {name: word for word, name in TASKS.items()}
    root = Path(_text(node, "basepath") or ".") / (_text(node, "root") or words.get(task, task))
    place, _ = node.entries["root" if "root" in node.entries else "task"]
    return Scalar(str(root / Path(scene.rpartition(":")[2]).name), False, place)


def _text(node: Mapping, key: str) -> str | None:
    if key not in node.entries:
        return None
    place, item = node.entries[key]
    if not isinstance(item, Scalar):
        raise place.error(key, "expected one word or path")
    return None if item.is_null else item.text


def simulation_from_python(path: Path) -> Mapping:
    """Converts CARLA-GeAR's `simulation_configs.py` to gear's simulation config, without running the file.

    Only plain assignments of literals to `SEED_VALUES`, `ITERATION_VALUES`, `MAX_VEHICLE_NPC` and `MAX_WALKER_NPC` are
    read. Everything else in the file is ignored, unless it may change one of these four names.

    Args:
        path: path of the Python file.

    Raises:
        ConfigError: the file is not Python; one of the four names is computed or may be changed elsewhere; or a seed
            has no number of samples.
    """
    try:
        tree = ast.parse(text_of(path))
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        line = getattr(error, "lineno", None) or 0
        raise ConfigError(path, line, 1, "", "is not Python; write a YAML simulation config instead") from error
    wanted: dict[str, Node] = {}
    plain: set[ast.AST] = set()
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            target = statement.targets[0]
        elif isinstance(statement, ast.AnnAssign):
            target = statement.target
        else:
            continue
        plain.add(target)
        if isinstance(target, ast.Name) and target.id in SIMULATION_NAMES and statement.value is not None:
            try:
                wanted[target.id] = _node_of(statement.value, path)
            except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError) as error:
                raise _place(statement, path).error(target.id, COMPUTED) from error
    for parent in ast.walk(tree):
        for node in ast.iter_child_nodes(parent):
            if node in plain:
                continue
            if isinstance(node, ast.Name) and node.id in SIMULATION_NAMES and _may_change(node, parent):
                raise _place(node, path).error(node.id, COMPUTED)
            if isinstance(node, ast.alias) and (node.asname or node.name) in SIMULATION_NAMES:
                raise _place(node, path).error(node.asname or node.name, COMPUTED)
    return _simulation(path, wanted)


def _may_change(name: ast.Name, parent: ast.AST) -> bool:
    """Whether an expression may change the value of a name."""
    if not isinstance(name.ctx, ast.Load):
        return True
    if name.id not in TABLES:
        return False
    match parent:
        case ast.Subscript(value=held):
            return held is not name or not isinstance(parent.ctx, ast.Load)
        case ast.Attribute(attr=method):
            return method not in READING_METHODS
        case ast.Call(func=ast.Name(id=function)):
            return function not in READING_FUNCTIONS
        case ast.For(iter=held) | ast.comprehension(iter=held):
            return held is not name
    return not isinstance(parent, ast.BinOp | ast.Compare | ast.FormattedValue)


def _node_of(expression: ast.expr, path: Path) -> Node:
    """A literal expression as a node.

    Raises:
        ValueError, TypeError, SyntaxError, MemoryError, RecursionError: it is no literal.
    """
    value = ast.literal_eval(expression)
    if not isinstance(expression, ast.Dict):
        return Scalar(str(value), False, _place(expression, path))
    entries: dict[str, tuple[Place, Node]] = {}
    for key, below in zip(expression.keys, expression.values, strict=True):
        assert key is not None  # `**other` is no literal
        entries[str(ast.literal_eval(key))] = (_place(key, path), _node_of(below, path))
    return Mapping(entries, _place(expression, path))


def _place(found: ast.expr | ast.stmt | ast.alias, path: Path) -> Place:
    return Place(str(path), found.lineno, found.col_offset + 1)


def _simulation(path: Path, wanted: dict[str, Node]) -> Mapping:
    seeds, counts = wanted.get("SEED_VALUES"), wanted.get("ITERATION_VALUES")
    if not (isinstance(seeds, Mapping) and isinstance(counts, Mapping)):
        raise ConfigError(
            path, 0, 0, "", "has no SEED_VALUES and ITERATION_VALUES; is it a CARLA-GeAR simulation config?"
        )
    splits: dict[str, tuple[Place, Node]] = {}
    for split, (place, seed) in seeds.entries.items():
        if split not in counts.entries:
            raise place.error(f"SEED_VALUES.{split}", "has no count in ITERATION_VALUES; add one, or take the seed out")
        entries = {"seed": (place, seed), "samples": counts.entries[split]}
        if split == "video":
            entries["frames"] = (place, Scalar("105", False, place))
        splits[split] = (place, Mapping(entries, place))
    given: dict[str, tuple[Place, Node]] = {"splits": (seeds.place, Mapping(splits, seeds.place))}
    for name, key in (("MAX_VEHICLE_NPC", "max_vehicles"), ("MAX_WALKER_NPC", "max_pedestrians")):
        if name in wanted:
            given[key] = (wanted[name].place, wanted[name])
    return Mapping(given, seeds.place)
