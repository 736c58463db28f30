"""What the site adds to Sphinx: pages that are generated from the code, and a check that every public name has a page.

Generated pages lie under `reference/generated/` and are never committed.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import cli_pages
import plugin_pages
from sphinx.application import Sphinx
from sphinx.ext import napoleon
from sphinx.util import logging

logger = logging.getLogger(__name__)

PUBLIC = (
    "gear.contracts",
    "gear.values",
    "gear.readers",
    "gear.testing",
    "gear.compositor.registry",
    "gear.augment.geometry",
    "gear.augment.registry",
    "gear.plugins.defenses.per_picture",
)
"""Packages and modules that users and plugin authors import; with `gear` itself they are the Python API."""

GENERATED = "reference/generated"
NOTEBOOKS = Path(__file__).parents[2] / "examples" / "notebooks"
"""Notebooks, which become pages of the site."""


def write_generated_pages(app: Sphinx) -> None:
    """Writes the pages of commands, plugins, Python modules and notebooks into the source folder."""
    folder = Path(app.srcdir) / GENERATED
    folder.mkdir(parents=True, exist_ok=True)
    pages = {"cli.md": cli_pages.page(), "plugins.md": plugin_pages.page(), "gear.md": _top_page()}
    names = module_names()
    pages |= {f"{name}.md": _module_page(name) for name in names}
    pages["api.md"] = _index(["gear", *names])
    for stale in set(folder.glob("*.md")) - {folder / name for name in pages}:
        stale.unlink()
    pages |= {path.name: path.read_text(encoding="utf-8") for path in sorted(NOTEBOOKS.glob("*.ipynb"))}
    for stale in set(folder.glob("*.ipynb")) - {folder / name for name in pages}:
        stale.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:  # unchanged pages need no new build
            path.write_text(text, encoding="utf-8")


def module_names() -> list[str]:
    """The public modules by their dotted names, sorted; packages that only hold modules are left out."""
    names: list[str] = []
    for root in PUBLIC:
        package = importlib.import_module(root)
        names.append(root)
        for found in pkgutil.walk_packages(getattr(package, "__path__", []), f"{root}."):
            if not found.name.rsplit(".", 1)[-1].startswith("_"):
                names.append(found.name)
    return sorted(name for name in names if public_members(importlib.import_module(name)))


def public_members(module: ModuleType) -> dict[str, Any]:
    """The classes and functions that a module offers under public names and defines itself."""
    return {
        name: member
        for name, member in vars(module).items()
        if not name.startswith("_")
        and (inspect.isclass(member) or inspect.isfunction(member))
        and member.__module__ == module.__name__
    }


def check_public_names(app: Sphinx, error: Exception | None) -> None:
    """Warns, which fails a strict build, of every public name that no page documents."""
    if error is not None:
        return
    documented = {name.replace("gear.gear.", "gear.") for name in app.env.domains.python_domain.objects}
    for name in module_names():
        for member in public_members(importlib.import_module(name)):
            if f"{name}.{member}" not in documented:
                logger.warning("%s.%s is public and has no docstring, so that no page documents it", name, member)
    import gear

    for member in gear.__all__:
        if not {f"gear.{member}", f"{getattr(gear, member).__module__}.{member}"} & documented:
            logger.warning("gear.%s is public and no page documents it", member)


def convert_docstring(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Turns the sections of a Google docstring into reStructuredText, in place.

    `sphinx.ext.napoleon` as an extension would read the first colon in a constant's docstring as the end of a type.
    """
    if what in ("attribute", "data", "property"):
        return
    config = napoleon.Config(napoleon_use_ivar=True, napoleon_use_rtype=False)
    lines[:] = napoleon.GoogleDocstring(_one_name_per_entry(lines), config, app, what, name, obj, options).lines()


def _one_name_per_entry(lines: list[str]) -> list[str]:
    """Repeats the text of an entry `a, b: text` under each of its names: Sphinx knows entries of one name only."""
    result: list[str] = []
    at = 0
    while at < len(lines):
        entry = re.match(r" {4}(\w+(?:, \w+)+): (.*)", lines[at])
        at += 1
        if entry is None:
            result.append(lines[at - 1])
            continue
        more: list[str] = []
        while at < len(lines) and lines[at].startswith(" " * 8):
            more.append(lines[at])
            at += 1
        for name in entry[1].split(", "):
            result += [f"    {name}: {entry[2]}", *more]
    return result


def _module_page(name: str) -> str:
    return f"# `{name}`\n\n```{{eval-rst}}\n.. automodule:: {name}\n```\n"


def _top_page() -> str:
    import gear

    functions = [name for name in gear.__all__ if inspect.isfunction(getattr(gear, name))]
    public = set(module_names())
    classes = [name for name in gear.__all__ if inspect.isclass(getattr(gear, name))]
    elsewhere = {name: getattr(gear, name).__module__ for name in classes if getattr(gear, name).__module__ in public}
    lines = ["# `gear`", "", "```{eval-rst}", ".. py:module:: gear", ""]
    for name in functions:
        lines += [f".. autofunction:: gear.{name}", ""]
    for name in classes:
        if name not in elsewhere:
            lines += [f".. autoclass:: gear.{name}", ""]
    links = [f"`gear.{name}` is {{py:class}}`{home}.{name}`." for name, home in elsewhere.items()]
    return "\n".join([*lines, "```", "", *links, ""])


def _index(names: list[str]) -> str:
    return "\n".join(
        [
            "# Python API",
            "",
            "`gear` holds one function for each command. The other modules are what plugins and training code import;",
            "modules that are not listed here may change without notice.",
            "",
            "```{toctree}",
            ":maxdepth: 1",
            "",
            *names,
            "```",
            "",
        ]
    )


def setup(app: Sphinx) -> dict[str, Any]:
    """Connects the generators and the check to the build."""
    app.connect("builder-inited", write_generated_pages)
    app.connect("autodoc-process-docstring", convert_docstring)
    app.connect("build-finished", check_public_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
