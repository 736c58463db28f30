"""Finds the layouts of `gear export` by the names of their modules in this folder."""

from __future__ import annotations

import importlib
import pkgutil

from gear.formats import exports
from gear.formats.exports.layout import Layout
from gear.values.errors import UnknownNameError

NO_LAYOUTS = ("layout", "registry", "sequences")
"""Modules of this folder that do not define a layout."""


def layout_names() -> list[str]:
    """The names of all layouts, sorted. Names have hyphens: the module `kitti_depth.py` is the layout `kitti-depth`."""
    return sorted(
        one.name.replace("_", "-") for one in pkgutil.iter_modules(exports.__path__) if one.name not in NO_LAYOUTS
    )


def find_layout(name: str) -> Layout:
    """Finds the layout of `gear export` with this name, such as `kitti-depth`.

    Args:
        name: name of the layout, with hyphens.

    Raises:
        UnknownNameError: there is no such layout.
    """
    known = layout_names()
    if name not in known:
        raise UnknownNameError("layout", name, known)
    module = importlib.import_module(f"{exports.__name__}.{name.replace('-', '_')}")
    found: Layout = module.LAYOUT
    return found
