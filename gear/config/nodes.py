"""YAML as a tree of texts with their positions in the file.

The types of values are decided by the dataclass that reads the tree, and not by YAML.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

import yaml

from gear.values.errors import ConfigError
from gear.values.regular_file import read_regular
from gear.values.resources import data_dir

MAX_BYTES = 4 << 20

_FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The parser of libyaml, which most builds of PyYAML include."""

MARKS = "'\"[{&*!|>"
"""First characters of YAML values that are not bare words, such as quoted texts, lists and mappings."""


@dataclass(frozen=True, slots=True)
class Place:
    """The position of a value in a config.

    Attributes:
        path: path of the file, or a name such as that of a command-line flag.
        line, column: position in the file, counted from 1; line 0 for a value that is in no file.
    """

    path: str
    line: int = 0
    column: int = 0

    def error(self, key: str, problem: str) -> ConfigError:
        """A `ConfigError` at this position.

        For a value of a command-line flag the key is left out of the message, because the flag already names it.

        Args:
            key: key of the value, with dots.
            problem: what is wrong with the value.
        """
        key = "" if self.path == f"--{key}" else key
        return ConfigError(self.path, self.line, self.column, key, problem)


@dataclass(frozen=True, slots=True)
class Scalar:
    """A scalar of a YAML file, as text.

    Attributes:
        text: the text, without quotes.
        is_null: whether the value is empty, or `null` or `~` without quotes.
        place: position of the value.
    """

    text: str
    is_null: bool
    place: Place


@dataclass(frozen=True, slots=True)
class Items:
    """A YAML list.

    Attributes:
        items: the nodes of the list.
        place: position of the list.
    """

    items: tuple[Node, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Mapping:
    """A YAML mapping. A repeated key is an error when the file is read.

    Attributes:
        entries: position of the key, and node of the value, by key, in the order of the file.
        place: position of the mapping.
    """

    entries: dict[str, tuple[Place, Node]]
    place: Place


Node = Scalar | Items | Mapping


def parse_file(path: Path) -> Node:
    """Reads a YAML file as a tree of texts.

    Args:
        path: path of the file.

    Raises:
        ConfigError: the file is missing, too large, not UTF-8 or not YAML, or repeats a key.
    """
    text, name = text_of(path), str(path)
    if path.is_relative_to(data_dir("configs")):
        # libyaml takes a tenth of the time. It is used for gear's own files only: it takes some files that PyYAML
        # refuses, and deep nesting exhausts its stack. PyYAML words the errors.
        with contextlib.suppress(yaml.YAMLError):
            return _tree(yaml.compose(text, Loader=_FAST_LOADER), name)
    return parse_text(text, name)


def text_of(path: Path) -> str:
    """Reads a config file as text.

    Args:
        path: path of the file.

    Raises:
        ConfigError: the file is missing, too large or not UTF-8.
    """
    try:
        data = read_regular(path, most_bytes=MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise ConfigError(path, 0, 0, "", f"a config of more than {MAX_BYTES >> 20} MiB is no config")
        return data.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise ConfigError(path, 0, 0, "", f"cannot read it: {error.strerror}") from error
    except UnicodeDecodeError as error:
        before = error.object[: error.start].decode("utf-8").split("\n")
        problem = f"is not UTF-8 text (byte {error.object[error.start]:#04x}); save it as UTF-8"
        raise ConfigError(path, len(before), len(before[-1]) + 1, "", problem) from error


def parse_text(text: str, name: str) -> Node:
    """Parses YAML text to a tree of texts.

    Args:
        text: the YAML text.
        name: name that error messages show instead of a file.

    Raises:
        ConfigError: the text is not YAML, repeats a key, or is nested too deeply.
    """
    try:
        return _tree(yaml.compose(text, Loader=yaml.SafeLoader), name)
    except RecursionError as error:
        raise ConfigError(name, 0, 0, "", "is nested too deeply; no config needs so many brackets") from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        raise ConfigError(name, line, column, "", f"is not YAML: {error.problem or error.context}") from error
    except yaml.reader.ReaderError as error:  # its own text is two lines long
        before = text[: error.position].split("\n")
        problem = f"is not YAML: {error.reason} ({text[error.position]!r})"
        raise ConfigError(name, len(before), len(before[-1]) + 1, "", problem) from error
    except yaml.YAMLError as error:
        raise ConfigError(name, 0, 0, "", f"is not YAML: {error}") from error


def parse_value(text: str, name: str) -> Node:
    """Parses one value of the command line, such as `12`, `fog`, `[1, 2]` or `{a: 1}`.

    A `#` after a bare word does not begin a comment. Positions have no line and column.

    Args:
        text: the value.
        name: name of the option, for messages.
    """
    if "#" in text and text.strip()[0] not in MARKS:
        return Scalar(text.strip(), False, Place(name))
    return in_one_place(parse_text(text, name), Place(name)) if text.strip() else Scalar("", True, Place(name))


def in_one_place(node: Node, place: Place) -> Node:
    """Copies a tree and gives all nodes one position, for text that the user has not written in a file.

    Args:
        node: the tree; it is not changed.
        place: the position that all nodes get.
    """
    done: dict[int, Node] = {}

    def moved(node: Node) -> Node:
        if id(node) not in done:  # once for whatever aliases share
            if isinstance(node, Items):
                done[id(node)] = Items(tuple(map(moved, node.items)), place)
            elif isinstance(node, Mapping):
                done[id(node)] = Mapping({key: (place, moved(item)) for key, (_, item) in node.entries.items()}, place)
            else:
                done[id(node)] = Scalar(node.text, node.is_null, place)
        return done[id(node)]

    return moved(node)


def _tree(root: yaml.Node | None, name: str) -> Node:
    return Mapping({}, Place(name, 1, 1)) if root is None else _convert(root, name, "", {})


def _convert(node: yaml.Node, name: str, key: str, done: dict[int, Node | None]) -> Node:
    """Converts a PyYAML node. `done` holds the targets of aliases, so that aliases of aliases cost nothing; None
    marks a node being converted.
    """
    place = Place(name, node.start_mark.line + 1, node.start_mark.column + 1)
    if id(node) in done:
        known = done[id(node)]
        if known is None:
            raise place.error(key, "an alias that contains itself")
        return known
    done[id(node)] = None
    done[id(node)] = converted = _convert_new(node, place, key, done)
    return converted


def _convert_new(node: yaml.Node, place: Place, key: str, done: dict[int, Node | None]) -> Node:
    if isinstance(node, yaml.ScalarNode):
        if node.tag.startswith("tag:yaml.org,2002:python"):
            raise place.error(key, "Python tags are not read")
        return Scalar(node.value, node.tag == "tag:yaml.org,2002:null" and node.style is None, place)
    if isinstance(node, yaml.SequenceNode):
        return Items(tuple(_convert(item, place.path, f"{key}[{i}]", done) for i, item in enumerate(node.value)), place)
    entries: dict[str, tuple[Place, Node]] = {}
    for key_node, value_node in node.value:
        key_place = Place(place.path, key_node.start_mark.line + 1, key_node.start_mark.column + 1)
        if not isinstance(key_node, yaml.ScalarNode):
            raise key_place.error(key, "keys are plain words")
        full = f"{key}.{key_node.value}" if key else key_node.value
        if key_node.value in entries:
            raise key_place.error(full, f"given twice (first in line {entries[key_node.value][0].line})")
        entries[key_node.value] = (key_place, _convert(value_node, place.path, full, done))
    return Mapping(entries, place)
