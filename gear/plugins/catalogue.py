"""The catalogue of plugins: working plugins with their packages, broken plugins, and the look-up by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gear.contracts.specs import KINDS, AnySpec, Kind
from gear.plugins.text import type_name
from gear.values.errors import DuplicateNameError, PluginError, UnknownNameError


@dataclass(frozen=True, slots=True, kw_only=True)
class Owner:
    """The Python package (distribution) that contains a plugin.

    Attributes:
        plugin: name of the plugin's entry point; for built-in plugins the name of the module.
        package: name of the distribution; `mujoco-gear` for built-in plugins.
        version: version of the distribution.
    """

    plugin: str
    package: str
    version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginEntry:
    """A working plugin in the catalogue: its kind, its spec and its package.

    Attributes:
        kind: kind of plugin, such as `model` or `attack`.
        spec: the plugin's description: name, options and `build` function.
        owner: the package that contains the plugin.
    """

    kind: Kind
    spec: AnySpec
    owner: Owner

    @property
    def full_name(self) -> str:
        """`package/name`, which is unique among all installed plugins."""
        return f"{self.owner.package}/{self.spec.name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Broken:
    """A plugin that failed to load.

    Attributes:
        owner: the package that contains the plugin.
        stage: step at which it failed: `entry_points.txt`, `import`, `register`, `hook <name>` or `spec`.
        problem: the failure in one line.
    """

    owner: Owner
    stage: str
    problem: str

    def error(self) -> PluginError:
        """The failure as an exception, which `--strict-plugins` raises."""
        return PluginError(f"{self.owner.plugin} ({self.owner.package} {self.owner.version})", self.stage, self.problem)


@dataclass(frozen=True, slots=True)
class Catalogue:
    """All plugins that are installed in this Python environment.

    Attributes:
        found: plugins that work.
        broken: plugins that failed to load.
    """

    found: tuple[PluginEntry, ...]
    broken: tuple[Broken, ...] = field(default=())

    def of_kind(self, kind: Kind) -> tuple[PluginEntry, ...]:
        """The plugins of a kind, sorted by name, then by package.

        Args:
            kind: kind of plugin, such as `model` or `attack`.
        """
        return tuple(sorted((f for f in self.found if f.kind == kind), key=lambda f: (f.spec.name, f.owner.package)))

    def names(self, kind: Kind) -> tuple[str, ...]:
        """The names for finding the plugins of a kind: the short name if it is unique, otherwise `package/name`.

        Args:
            kind: kind of plugin, such as `model` or `attack`.
        """
        found = self.of_kind(kind)
        short = [f.spec.name for f in found]
        return tuple(f.spec.name if short.count(f.spec.name) == 1 else f.full_name for f in found)

    def get(self, kind: Kind, name: str) -> PluginEntry:
        """Returns the plugin of a kind with a unique short name, or with a full name `package/name`.

        Args:
            kind: kind of plugin, such as `model` or `attack`.
            name: short or full name of the plugin.

        Raises:
            UnknownNameError: there is no such plugin; the message suggests similar names and lists plugins that failed
                to load.
            DuplicateNameError: several plugins have the name.
        """
        found = self.of_kind(kind)
        hits = [f for f in found if name in (f.spec.name, f.full_name)]
        if len(hits) == 1:
            return hits[0]
        if hits:
            raise DuplicateNameError(kind, name, (f.full_name for f in hits))
        raise UnknownNameError(kind, name, self.names(kind), self.broken_hint())

    def broken_hint(self) -> str:
        """A text in brackets with the plugins that failed to load, for messages about unknown names; "" for none."""
        if not self.broken:
            return ""
        names = dict.fromkeys(b.owner.plugin for b in self.broken)
        return f"({len(names)} plugin(s) failed to load: {', '.join(names)}; see `gear plugins`)"

    def clashes(self) -> tuple[tuple[Kind, str, tuple[str, ...]], ...]:
        """Short names that several packages use: kind, short name, and the full names."""
        result: list[tuple[Kind, str, tuple[str, ...]]] = []
        for kind in KINDS:
            by_name: dict[str, list[str]] = {}
            for f in self.of_kind(kind):
                by_name.setdefault(f.spec.name, []).append(f.full_name)
            result.extend((kind, name, tuple(full)) for name, full in by_name.items() if len(full) > 1)
        return tuple(result)


def as_iterable(value: Any) -> Iterable[Any]:
    """Checks that the return value of a plugin's hook is a collection of specs, and returns it.

    Args:
        value: whatever the hook returned.

    Raises:
        TypeError: the value is not a collection, or a text or dictionary.
    """
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise TypeError(f"a hook returns a list of specs, got {type_name(value)}")
    return value
