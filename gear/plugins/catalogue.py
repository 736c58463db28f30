"""What was found: specs with their owners, and plugins that broke. Names are looked up here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gear.contracts.specs import KINDS, AnySpec, Kind
from gear.values.errors import DuplicateNameError, PluginError, UnknownNameError


@dataclass(frozen=True, slots=True, kw_only=True)
class Owner:
    """Whose a plugin is.

    Attributes:
        plugin: name of its entry point, or of its module for built-ins.
        package: distribution, `mujoco-gear` for built-ins.
        version: of the distribution.
    """

    plugin: str
    package: str
    version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginEntry:
    """A plugin in the catalogue: one spec and the distribution that brings it."""

    kind: Kind
    spec: AnySpec
    owner: Owner

    @property
    def full_name(self) -> str:
        """`package/name`: unique whatever else is installed."""
        return f"{self.owner.package}/{self.spec.name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Broken:
    """A plugin that failed; everything else goes on working.

    Attributes:
        owner: whose it is.
        stage: `import`, `register`, `hook`, `spec`.
        problem: one line.
    """

    owner: Owner
    stage: str
    problem: str

    def error(self) -> PluginError:
        """As an exception, for `--strict-plugins`."""
        return PluginError(f"{self.owner.plugin} ({self.owner.package} {self.owner.version})", self.stage, self.problem)


@dataclass(frozen=True, slots=True)
class Catalogue:
    """All plugins of this environment."""

    found: tuple[PluginEntry, ...]
    broken: tuple[Broken, ...] = field(default=())

    def of_kind(self, kind: Kind) -> tuple[PluginEntry, ...]:
        """Sorted by name, then package."""
        return tuple(sorted((f for f in self.found if f.kind == kind), key=lambda f: (f.spec.name, f.owner.package)))

    def names(self, kind: Kind) -> tuple[str, ...]:
        """How each can be asked for: short where that is unique."""
        found = self.of_kind(kind)
        short = [f.spec.name for f in found]
        return tuple(f.spec.name if short.count(f.spec.name) == 1 else f.full_name for f in found)

    def get(self, kind: Kind, name: str) -> PluginEntry:
        """By short name if unique, else by `package/name`.

        Raises:
            UnknownNameError: nothing answers to it; says what was meant and what failed to load.
            DuplicateNameError: two do.
        """
        found = self.of_kind(kind)
        hits = [f for f in found if name in (f.spec.name, f.full_name)]
        if len(hits) == 1:
            return hits[0]
        if hits:
            raise DuplicateNameError(kind, name, (f.full_name for f in hits))
        raise UnknownNameError(kind, name, self.names(kind), self.broken_hint())

    def broken_hint(self) -> str:
        """What failed to load, for those who miss a name; "" if nothing did."""
        if not self.broken:
            return ""
        names = dict.fromkeys(b.owner.plugin for b in self.broken)
        return f"({len(names)} plugin(s) failed to load: {', '.join(names)}; see `gear plugins`)"

    def clashes(self) -> tuple[tuple[Kind, str, tuple[str, ...]], ...]:
        """Short names that more than one package claims, with their full names."""
        result: list[tuple[Kind, str, tuple[str, ...]]] = []
        for kind in KINDS:
            by_name: dict[str, list[str]] = {}
            for f in self.of_kind(kind):
                by_name.setdefault(f.spec.name, []).append(f.full_name)
            result.extend((kind, name, tuple(full)) for name, full in by_name.items() if len(full) > 1)
        return tuple(result)


def as_iterable(value: Any) -> Iterable[Any]:
    """What a hook returned, if it can be walked.

    Raises:
        TypeError: it cannot.
    """
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise TypeError(f"a hook returns a list of specs, got {type(value).__name__}")
    return value
