"""The folder in which gear keeps what it can make again, such as compiled worlds."""

from __future__ import annotations

import os
from pathlib import Path


def user_cache_folder() -> Path:
    """The folder `gear` in the user's cache folder: `$XDG_CACHE_HOME`, or `~/.cache`. It need not exist.

    Raises:
        RuntimeError: the user has no home folder.
    """
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gear"
