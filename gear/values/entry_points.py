"""Reads the entry points of installed distributions, one distribution at a time.

`importlib.metadata.entry_points` fails as a whole if the `entry_points.txt` of any distribution has a malformed line.
"""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass
from importlib.metadata import EntryPoint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DamagedDistribution:
    """A distribution whose entry points cannot be read.

    Attributes:
        name, version: name and version of the distribution.
        error: the exception that reading raised.
    """

    name: str
    version: str
    error: Exception


def installed_entry_points(group: str) -> tuple[list[EntryPoint], list[DamagedDistribution]]:
    """The entry points of a group, and the distributions whose entry points cannot be read, sorted by name.

    If a distribution is on the path several times, the first one counts, as for `import`.

    Args:
        group: name of the group, such as `gear.plugins`.
    """
    found: list[EntryPoint] = []
    damaged: list[DamagedDistribution] = []
    seen: set[str] = set()
    for distribution in importlib.metadata.distributions():
        error, chosen = None, importlib.metadata.EntryPoints()
        try:
            chosen = distribution.entry_points.select(group=group)
        except Exception as raised:
            error = raised
        if error is None and not chosen:
            continue
        name, version = identity(distribution)
        if name in seen:
            continue
        seen.add(name)
        found += chosen
        if error is not None:
            damaged.append(DamagedDistribution(name=name, version=version, error=error))
    return found, sorted(damaged, key=lambda one: one.name)


def identity(distribution: importlib.metadata.Distribution) -> tuple[str, str]:
    """Name and version of a distribution; if its metadata are damaged, name and version are taken from the name of
    its folder.

    Args:
        distribution: the installed distribution.
    """
    try:
        name, version = str(distribution.name or ""), str(distribution.version or "")
    except Exception:  # the metadata of a stranger's package may raise anything
        name = version = ""
    # There is no public way to a distribution's folder.
    folder = str(getattr(getattr(distribution, "_path", None), "stem", "?"))
    return name or folder.partition("-")[0], version or folder.partition("-")[2] or "?"
