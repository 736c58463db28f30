"""A progress bar on stderr, silent when stderr is no terminal."""

from __future__ import annotations

from types import TracebackType
from typing import Any

from tqdm import tqdm


class ProgressBar:
    """Shows samples finished, rate and time left; a `Progress` of `gear.collect`."""

    def __init__(self, unit: str = "sample") -> None:
        self._unit = unit
        self._bar: tqdm[Any] | None = None

    def __call__(self, finished: int, total: int) -> None:
        """Shows `finished` of `total`."""
        if self._bar is None:
            self._bar = tqdm(
                total=total or None, initial=finished, unit=self._unit, disable=None, dynamic_ncols=True, smoothing=0.1
            )
            return
        self._bar.update(finished - self._bar.n)

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()
