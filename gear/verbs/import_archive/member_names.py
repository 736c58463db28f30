"""Checks the paths of an archive's members as text, before anything is written."""

from __future__ import annotations

import unicodedata
from pathlib import Path, PurePosixPath

from gear.dataset.guarded_paths import parts_of
from gear.plugins.text import printable
from gear.values.errors import DatasetError

CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories that no name may contain: control and format characters, bytes that are no text, line and
paragraph separators.
"""

LONGEST_NAME_BYTES, DEEPEST = 255, 64
"""Largest length of the name of a file or folder in UTF-8, as file systems have it; largest number of folders in
folders.
"""


class MemberNames:
    """The paths of an archive's members, of which no two may be the same file on any file system."""

    def __init__(self, archive: Path) -> None:
        """Starts without members.

        Args:
            archive: path of the archive, for messages.
        """
        self._archive = archive
        self._files: dict[str, str] = {}

    def check(self, path: str) -> None:
        """Checks the path of one member.

        Args:
            path: path in the archive, without empty components.

        Raises:
            DatasetError: the path leads outside, is too long or too deep, or contains control characters.
        """
        shown = printable(path)
        if any(unicodedata.category(char) in CONTROL for char in path):
            raise DatasetError(self._archive, f"holds '{shown}', a name with control characters")
        parts = parts_of(self._archive, path)
        if len(parts) > DEEPEST:
            raise DatasetError(self._archive, f"holds '{shown}', which is more than {DEEPEST} folders deep")
        if any(len(part.encode()) > LONGEST_NAME_BYTES for part in parts):
            raise DatasetError(self._archive, f"holds '{shown}', a name of more than {LONGEST_NAME_BYTES} bytes")

    def add_file(self, path: str) -> None:
        """Adds a file.

        Args:
            path: path of the file, which `check` has passed.

        Raises:
            DatasetError: another file has the same path, or one that differs only in case or in Unicode's form.
        """
        key = _comparable(path)
        other = self._files.get(key)
        if other == path:
            raise DatasetError(self._archive, f"holds '{printable(path)}' twice")
        if other is not None:
            names = f"'{printable(other)}' and '{printable(path)}'"
            raise DatasetError(self._archive, f"holds {names}, which are one file on some file systems")
        self._files[key] = path

    def check_folders(self) -> None:
        """Checks that no file has the path of a folder of another file; called after the last member.

        Raises:
            DatasetError: a file has the path of a folder.
        """
        for key, path in self._files.items():
            for folder in PurePosixPath(key).parents:
                if (other := self._files.get(str(folder))) is not None:
                    names = f"'{printable(path)}' in a folder '{printable(other)}'"
                    raise DatasetError(self._archive, f"holds {names}, which is a file, too")


def _comparable(path: str) -> str:
    """A path in the form in which file systems that ignore case and Unicode's form compare it."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())
