"""The catalogue of plugins: specs with their owners, broken plugins, and the look-up of names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gear.contracts.specs import KINDS, AnySpec, Kind
from gear.values.errors import DuplicateNameError, PluginError, UnknownNameError


@dataclass(frozen=True, slots=True, kw_only=True)
class Owner:
    """The distribution that contains a plugin.

    Attributes:
        plugin: name of its entry point; for built-ins the name of the module.
        package: name of the distribution; `mujoco-gear` for built-ins.
        version: version of the distribution.
    """

    plugin: str
    package: str
    version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginEntry:
    """A plugin in the catalogue: one spec and its distribution."""

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
        owner: the distribution that contains it.
        stage: `entry_points.txt`, `import`, `register`, `hook <name>` or `spec`.
        problem: one line.
    """

    owner: Owner
    stage: str
    problem: str

    def error(self) -> PluginError:
        """The failure as an exception, for `--strict-plugins`."""
        return PluginError(f"{self.owner.plugin} ({self.owner.package} {self.owner.version})", self.stage, self.problem)


@dataclass(frozen=True, slots=True)
class Catalogue:
    """All plugins of this environment.

    Attributes:
        found: plugins that work.
        broken: plugins that failed.
    """

    found: tuple[PluginEntry, ...]
    broken: tuple[Broken, ...] = field(default=())

    def of_kind(self, kind: Kind) -> tuple[PluginEntry, ...]:
        """The plugins of a kind, sorted by name, then package."""
        return tuple(sorted((f for f in self.found if f.kind == kind), key=lambda f: (f.spec.name, f.owner.package)))

    def names(self, kind: Kind) -> tuple[str, ...]:
        """The names by which the plugins of a kind are found: the short name if it is unique, otherwise
        `package/name`.
        """
        found = self.of_kind(kind)
        short = [f.spec.name for f in found]
        return tuple(f.spec.name if short.count(f.spec.name) == 1 else f.full_name for f in found)

    def get(self, kind: Kind, name: str) -> PluginEntry:
        """The plugin with a short name, if that is unique, or with a name `package/name`.

        Raises:
            UnknownNameError: there is none; the message suggests similar names and lists plugins that failed to load.
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
        """In brackets, the plugins that failed to load, for messages about unknown names; "" if none did."""
        if not self.broken:
            return ""
        names = dict.fromkeys(b.owner.plugin for b in self.broken)
        return f"({len(names)} plugin(s) failed to load: {', '.join(names)}; see `gear plugins`)"

    def clashes(self) -> tuple[tuple[Kind, str, tuple[str, ...]], ...]:
        """Short names that several packages use, with the full names."""
        result: list[tuple[Kind, str, tuple[str, ...]]] = []
        for kind in KINDS:
            by_name: dict[str, list[str]] = {}
            for f in self.of_kind(kind):
                by_name.setdefault(f.spec.name, []).append(f.full_name)
            result.extend((kind, name, tuple(full)) for name, full in by_name.items() if len(full) > 1)
        return tuple(result)


def as_iterable(value: Any) -> Iterable[Any]:
    """The return value of a hook, if it is a collection.

    Raises:
        TypeError: the value is not a collection.
    """
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise TypeError(f"a hook returns a list of specs, got {type(value).__name__}")
    return value
