"""The layouts of `gear export`, found by the names of their modules."""

from __future__ import annotations

import importlib
import pkgutil

from gear.formats import exports
from gear.formats.exports.layout import Layout
from gear.values.errors import UnknownNameError

NO_LAYOUTS = ("layout", "registry")
"""Modules of the folder that are no layout."""


def layout_names() -> list[str]:
    """Names of the layouts, sorted; `kitti_depth.py` is the layout `kitti-depth`."""
    return sorted(
        one.name.replace("_", "-") for one in pkgutil.iter_modules(exports.__path__) if one.name not in NO_LAYOUTS
    )


def find_layout(name: str) -> Layout:
    """A layout by its name.

    Raises:
        UnknownNameError: there is no such layout.
    """
    known = layout_names()
    if name not in known:
        raise UnknownNameError("layout", name, known)
    module = importlib.import_module(f"{exports.__name__}.{name.replace('-', '_')}")
    found: Layout = module.LAYOUT
    return found
