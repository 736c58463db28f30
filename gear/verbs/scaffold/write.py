"""`gear new`: fills templates and writes the Python package of a new plugin."""

from __future__ import annotations

import keyword
import os
import re
import shutil
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from gear.contracts.specs import KINDS, Kind
from gear.dataset.files import explained
from gear.plugins.manager import catalogue
from gear.plugins.spec_validation import HOOK_OF
from gear.values.errors import GearError, UnknownNameError

NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
TOKEN = re.compile(r"\{\{(\w+)\}\}")
TAKEN = ("spec", "build", "hookimpl", *HOOK_OF.values())
"""Names that every plugin package uses itself; a plugin must not have such a name."""

USE: dict[Kind, str] = {
    "task": "Use it: `gear collect --task {{name}}`, then `gear view` or `gear sheet` on what it wrote, and"
    " `gear evaluate` with a model that does it.",
    "model": "Use it: `gear evaluate --model {{name}} --data DIR` runs it over a dataset of its task; twins of the"
    " dataset, `--data CLEAN PATCHED`, are compared.",
    "attack": "Use it: `gear attack --attack {{name}} --model NAME --data DIR --out PATCH` makes a patch, DIR a dataset"
    " with `--probes`; `gear collect --patch PATCH` puts it into the world.",
    "defense": "Use it: `gear evaluate --model NAME --defense {{name}} --data DIR` is its row in an evaluation;"
    " `gear defend DIR --defense {{name}} --out DIR2` cleans a dataset's pictures.",
    "controller": "Use it: name it in a config of `gear drive`, `drivers: {mine: {controller: {{name}}}}`; `gear drive"
    " my.yml --out DIR` drives with it.",
    "metric": "Use it: `gear evaluate --model NAME --data DIR --report {{name}}` adds its columns to an evaluation.",
    "logger": "Use it: `gear attack`, `gear train` and `gear bench` log their runs with `--log-to {{name}}`.",
}


def new_package(kind: str, name: str, *, out: str | Path = ".") -> Path:
    """Writes a complete small Python package for a plugin: code, tests, README and licence.

    Args:
        kind: `task`, `model`, `attack`, `defense`, `controller`, `metric` or `logger`.
        name: name of the plugin, such as `my_blur`; hyphens are replaced by underscores.
        out: existing or new folder in which the package's folder `gear-<kind>-<name>` is created.

    Returns:
        The folder of the package. If an error occurs, no package is written.

    Raises:
        UnknownNameError: there is no such kind of plugin.
        GearError: the name is not valid or belongs to an installed plugin, or the folder exists already.
        DatasetError: a file cannot be written.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind of plugin", kind, KINDS)
    chosen = checked_name(name)
    if any(found.spec.name == chosen for found in catalogue().of_kind(kind)):
        raise GearError(f"there is a {kind} named {chosen!r} already; choose another name, such as my_{chosen}")
    words = {
        "kind": kind,
        "name": chosen,
        "dist": f"gear-{kind}-{chosen.replace('_', '-')}",
        "module": f"gear_{kind}_{chosen}",
        "Class": "".join(part.capitalize() for part in chosen.removesuffix(f"_{kind}").split("_")),
        "Kind": kind.capitalize(),
    }
    parent = Path(out)
    target = parent / words["dist"]
    if os.path.lexists(target):
        raise GearError(f"{target} is there already; choose another name or another --out")
    with explained(target):
        parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{words['dist']}-", dir=parent))
        try:
            package = scratch / words["dist"]
            for relative, text in contents(kind, words).items():
                path = package / relative
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            package.rename(target)
        finally:
            shutil.rmtree(scratch)
    return target


def contents(kind: Kind, words: dict[str, str]) -> dict[str, str]:
    """Returns the texts of all files of a new plugin package, by path relative to the package's folder.

    Args:
        kind: kind of the plugin.
        words: texts that replace the placeholders of the templates, by placeholder, such as `name` and `module`.
    """
    words = words | {"use": _filled(USE[kind], words)}
    places = {
        "pyproject.toml": "common/pyproject.toml",
        "README.md": "common/README.md",
        "LICENSE": "common/LICENSE",
        ".gitignore": "common/gitignore",
        f"src/{words['module']}/__init__.py": f"{kind}/init.py",
        f"src/{words['module']}/{words['name']}.py": f"{kind}/impl.py",
        f"tests/test_{words['name']}.py": f"{kind}/test.py",
    }
    templates = files("gear.verbs.scaffold") / "templates"
    texts = {
        place: _filled((templates / f"{template}.template").read_text(encoding="utf-8"), words)
        for place, template in places.items()
    }
    return texts | {f"src/{words['module']}/py.typed": ""}


def checked_name(name: str) -> str:
    """Returns the name of a plugin with underscores instead of hyphens, after checking it.

    Raises:
        GearError: the name is not valid.
    """
    chosen = name.replace("-", "_")
    if not NAME.fullmatch(chosen) or "__" in chosen or chosen.endswith("_"):
        raise GearError(
            f"{name!r} is not a plugin's name; use lower case letters, digits and single underscores, a letter first,"
            " at most 40, such as my_blur"
        )
    if keyword.iskeyword(chosen) or chosen in sys.stdlib_module_names:
        raise GearError(f"{name!r} is a word of Python's own; choose another, such as my_{chosen}")
    if chosen in TAKEN:
        raise GearError(f"{name!r} is a word of every plugin package's; choose another, such as my_{chosen}")
    return chosen


def _filled(template: str, words: dict[str, str]) -> str:
    return TOKEN.sub(lambda match: words[match[1]], template)
