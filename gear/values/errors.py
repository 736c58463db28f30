"""Errors that a user can correct. A `GearError` is shown as one line; any other exception is a bug with a traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class GearError(Exception):
    """An error that the user can correct. Its text states in one line what is wrong, where, and what to do."""


class FieldError(ValueError):
    """A value that a config class refuses. The config reader converts it to a `ConfigError` with file, line and
    column.

    Attributes:
        field: name of the refused field; nested names with dots.
        problem: description of what is wrong with the value.
    """

    def __init__(self, field: str, problem: str) -> None:
        """Makes the error.

        Args:
            field, problem: as the attributes.
        """
        super().__init__(field, problem)
        self.field = field
        self.problem = problem

    def __str__(self) -> str:
        return f"{self.field}: {self.problem}"


class ConfigError(GearError):
    """A config that cannot be read; its text is `path:line:column: key: problem`."""

    def __init__(self, path: Path | str, line: int, column: int, key: str, problem: str) -> None:
        """Makes the error.

        Args:
            path: path of the file, or the name that messages show instead.
            line, column: position counted from 1; line 0 if the value is in no file.
            key: key of the value, with dots; "" if the error belongs to no key.
            problem: what is wrong.
        """
        super().__init__(str(path), line, column, key, problem)
        self.path, self.line, self.column, self.key, self.problem = str(path), line, column, key, problem

    def __str__(self) -> str:
        place = f"{self.path}:{self.line}:{self.column}" if self.line else self.path
        return f"{place}: {self.key}: {self.problem}" if self.key else f"{place}: {self.problem}"


class UnknownNameError(GearError):
    """A name that is unknown. The error's text suggests the known name with the most similar spelling."""

    def __init__(self, kind: str, name: str, known: Iterable[str] = (), hint: str = "") -> None:
        """Makes the error.

        Args:
            kind: what the name should name, such as `town`.
            name: the unknown name.
            known: the names that exist.
            hint: further sentence at the end of the text.
        """
        names = tuple(sorted(known))
        super().__init__(kind, name, names, hint)
        self.kind, self.name, self.known, self.hint = kind, name, names, hint

    def __str__(self) -> str:
        close = difflib.get_close_matches(self.name.casefold(), [n.casefold() for n in self.known], n=1, cutoff=0.5)
        meant = [n for n in self.known if close and n.casefold() == close[0]]
        text = f"no {self.kind} named {self.name!r}"
        if meant:
            text += f"; did you mean {meant[0]}?"
        elif self.known:
            text += f"; there are: {', '.join(self.known)}"
        return f"{text} {self.hint}".rstrip()


class DuplicateNameError(GearError):
    """A plugin name that several packages use, given without the name of the package."""

    def __init__(self, kind: str, name: str, choices: Iterable[str]) -> None:
        """Makes the error.

        Args:
            kind: kind of plugin, such as `attack`.
            name: the name.
            choices: the full names, with the package, among which the user must choose.
        """
        listed = tuple(choices)
        super().__init__(kind, name, listed)
        self.kind, self.name, self.choices = kind, name, listed

    def __str__(self) -> str:
        return f"more than one {self.kind} is named {self.name!r}; say which: {', '.join(self.choices)}"


class PluginError(GearError):
    """A plugin that failed; the text states which plugin, at which stage, and the cause."""

    def __init__(self, plugin: str, stage: str, problem: str) -> None:
        """Makes the error.

        Args:
            plugin: name of the plugin.
            stage: what gear was doing, such as the hook or method that it called.
            problem: the cause in one line.
        """
        super().__init__(plugin, stage, problem)
        self.plugin, self.stage, self.problem = plugin, stage, problem

    def __str__(self) -> str:
        return f"plugin {self.plugin} failed at {self.stage}: {self.problem}"


class BackendError(GearError):
    """A renderer that cannot start on this machine. The text states what to install or which renderer to use
    instead.
    """

    def __init__(self, backend: str, problem: str, remedy: str) -> None:
        """Makes the error.

        Args:
            backend: name of the renderer.
            problem: why it cannot start.
            remedy: what to install, or which renderer to use instead.
        """
        super().__init__(backend, problem, remedy)
        self.backend, self.problem, self.remedy = backend, problem, remedy

    def __str__(self) -> str:
        return f"renderer {self.backend}: {self.problem}; {self.remedy}"


class WorkerInterruptedError(BackendError):
    """A worker process that was interrupted alone, as by `kill -INT`; the run ends, and nothing is tried again."""


class PatchError(GearError):
    """A patch file or folder that cannot be read or does not fit the dataset."""

    def __init__(self, path: Path | str, problem: str) -> None:
        """Makes the error.

        Args:
            path: path of the patch.
            problem: what is wrong with it.
        """
        super().__init__(str(path), problem)
        self.path, self.problem = str(path), problem

    def __str__(self) -> str:
        return f"patch {self.path}: {self.problem}"


class DatasetError(GearError):
    """A dataset on disk that cannot be read, extended or written."""

    def __init__(self, path: Path | str, problem: str) -> None:
        """Makes the error.

        Args:
            path: path of the dataset, or of the file in it.
            problem: what is wrong with it.
        """
        super().__init__(str(path), problem)
        self.path, self.problem = str(path), problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}"


class SamplesFailedError(DatasetError):
    """A split of which some samples could not be made; all other samples are made. Notes in the dataset state the
    causes.
    """


class ReplaceableError(DatasetError):
    """Existing output that was made with other settings, or is damaged; the option `--force` replaces it."""

    def __init__(self, path: Path | str, problem: str, *, split: str = "") -> None:
        """Makes the error.

        Args:
            path: path of the output.
            problem: what is wrong with it.
            split: name of the split that `--force` would replace; "" if it would replace the whole output.
        """
        super().__init__(path, problem)
        self.split = split

    def __str__(self) -> str:
        remedy = f"replace split {self.split!r} with --force" if self.split else "--force to replace it"
        return f"{super().__str__()}; use another --out, or {remedy}"


class OutdatedError(ReplaceableError):
    """Existing output with the same settings that was made from other input: other pictures, or another patch."""


class TownError(GearError):
    """A town, actor or surface whose MJCF does not follow gear's conventions."""

    def __init__(self, path: Path | str, problem: str) -> None:
        """Makes the error.

        Args:
            path: path of the MJCF file.
            problem: what is wrong with it.
        """
        super().__init__(str(path), problem)
        self.path, self.problem = str(path), problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem} (see docs/reference/mjcf.md)"


class PlacementError(GearError):
    """A scene whose actors or cameras cannot be placed."""

    def __init__(self, scene: str, problem: str) -> None:
        """Makes the error.

        Args:
            scene: name of the scene.
            problem: what cannot be placed, and which limit to change.
        """
        super().__init__(scene, problem)
        self.scene, self.problem = scene, problem

    def __str__(self) -> str:
        return f"scene {self.scene}: {self.problem}"
