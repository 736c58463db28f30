"""The callbacks that every long-running verb takes: how far it is, and what the user may not have meant."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Called with (done, total), first with what an earlier run finished; a total of 0 means that it is not known."""

Warn = Callable[[str], None]
"""Called with one line about something that is allowed and that the user may not have meant."""
