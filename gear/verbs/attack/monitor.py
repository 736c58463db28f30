"""Monitors a running attack: records curves, logs them, writes checkpoints, validates patches and stops early."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_bytes

from gear.contracts.attacks import Patch, State, surface_of
from gear.dataset.files import write_whole
from gear.measuring.patch_checks import is_picture
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, ReplaceableError
from gear.values.progress import Progress
from gear.values.regular_file import check_regular
from gear.values.serial import from_json
from gear.verbs.attack.run_log import AttackLog

CHECKPOINT = "checkpoint.safetensors"
SECONDS_BETWEEN = 20.0
BEST = "best/"
NOTED: Any = {
    "key": str, "done": int, "queries_left": float | None, "curves": dict[str, tuple[float, ...]],
    "judged": tuple[tuple[int, float], ...], "seconds": float,
}  # fmt: skip
"""Types of the JSON values in the header of a checkpoint; the arrays of the file are the state of the attack."""

Judge = Callable[[tuple[Patch, ...]], float]


@dataclass(eq=False, kw_only=True)
class Recorder:
    """The monitor that an attack calls after every step; it writes into the folder of the attack
    (`gear.contracts.attacks.Monitor`).

    Attributes:
        root: folder of the attack.
        key: hash of the plan (all inputs of the attack); a checkpoint with another hash is refused.
        steps: largest number of steps.
        judge: function that computes the harm (mean objective) of patches on validation samples; None without
            validation.
        every: steps between two validations.
        patience: validations without improvement after which the attack stops; 0 for never.
        queries: largest number of forward passes, for attacks that count them.
        on_progress: called with the finished and the allowed number of steps, or of queries.
        log: log of the attack; None for no log.
        curves: recorded values by name, one per step.
        judged: (step, harm) of every validation.
        best: the patches with the largest harm in a validation.
        is_asked: whether the attack has called `resume`, as attacks that report their steps do.
        done: number of finished steps, over all runs.
        stopped: why the attack ended before its budget was used; empty if it did not.
        seconds: time spent, over all runs.
    """

    root: Path
    key: str
    steps: int
    judge: Judge | None = None
    every: int = 25
    patience: int = 0
    queries: int | None = None
    on_progress: Progress = lambda done, total: None
    log: AttackLog | None = None
    curves: dict[str, list[float]] = field(default_factory=dict)
    judged: list[tuple[int, float]] = field(default_factory=list)
    best: tuple[Patch, ...] | None = None
    is_asked: bool = False
    done: int = 0
    stopped: str = ""
    seconds: float = 0.0

    def __post_init__(self) -> None:
        self._since = self._saved = time.monotonic()
        self._queries_left: float | None = None

    def resume(self) -> State | None:
        """Loads the checkpoint of an interrupted attack, with its curves and validations.

        Returns:
            The arrays that the attack saved, by name; None if there is no checkpoint.

        Raises:
            ReplaceableError: the checkpoint belongs to another attack.
            DatasetError: the checkpoint cannot be read.
        """
        self.is_asked = True
        path = self.root / CHECKPOINT
        if not path.exists():
            return None
        try:
            with safe_open(str(check_regular(path)), framework="numpy") as opened:
                notes = json.loads((opened.metadata() or {})["notes"])
                arrays = {name: opened.get_tensor(name) for name in opened.keys()}  # noqa: SIM118
            for name, kind in NOTED.items():
                from_json(kind, notes.get(name), name)
            kept = _best(arrays, is_judged=bool(notes["judged"]))
        except (SafetensorError, OSError, KeyError, AttributeError, ValueError, RecursionError) as error:
            raise DatasetError(path, f"is damaged ({one_line(error)}); delete it to start afresh") from error
        if notes["key"] != self.key:
            raise ReplaceableError(self.root, "holds an unfinished attack with other settings")
        self.curves, self.judged = notes["curves"], [(int(step), float(harm)) for step, harm in notes["judged"]]
        self.done, self.seconds = notes["done"], notes["seconds"]
        self.best = kept or self.best
        if self.log is not None:
            self.log.begin(self.done)
        self.tell(notes["done"], notes.get("queries_left"))
        return {name.removeprefix("state/"): arrays[name] for name in arrays if name.startswith("state/")}

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Records one finished step; validates the patches and writes a checkpoint when these are due.

        Args:
            done: number of finished steps.
            values: values of this step by name, such as the objective.
            patches: function that returns the current patches.
            state: function that returns the arrays from which the attack can continue.

        Returns:
            Whether the attack must stop, because validation no longer improves.
        """
        self.done = done
        if self.log is not None:
            self.log.step(done, values)
            if self.log.has_figures_at(done):
                self.log.patches(done, patches())
        for name, value in values.items():
            curve = self.curves.setdefault(name, [float("nan")] * (done - 1))
            curve += [float("nan")] * (done - 1 - len(curve)) + [float(value)]
        if self.judge is not None and (done % self.every == 0 or done == self.steps):
            self._validate(done, patches())
        self._queries_left = values.get("queries_left")
        now = time.monotonic()
        if now - self._saved >= SECONDS_BETWEEN and not self.stopped:  # a resumed run must stop at the same step
            self.save(done, state())
        self.tell(done, self._queries_left)
        return bool(self.stopped)

    def tell(self, done: int, queries_left: float | None = None) -> None:
        """Reports the progress to `on_progress`: in queries if the attack counts them, otherwise in steps.

        Args:
            done: number of finished steps.
            queries_left: number of remaining queries; None if the attack does not count queries.
        """
        if self.queries is None:
            self.on_progress(done, self.steps)
        else:
            self.on_progress(0 if queries_left is None else self.queries - int(queries_left), self.queries)

    def finish(self, done: int, last: tuple[Patch, ...]) -> None:
        """Validates the last patches if the attack ended between two validations, for example because its queries were
        used up.

        Args:
            done: number of finished steps.
            last: patches after the last step.
        """
        if self.judge is not None and (not self.judged or self.judged[-1][0] != done):
            self._validate(done, last)

    def save(self, done: int, state: State) -> None:
        """Writes the checkpoint atomically; does nothing if the attack has no state to save.

        Args:
            done: number of finished steps.
            state: arrays by name from which the attack can continue.
        """
        self._saved = time.monotonic()
        if not state:
            return
        self.clock()
        if self.log is not None:
            self.log.flush()
        arrays: dict[str, Any] = {f"state/{name}": np.array(value, order="C") for name, value in state.items()}
        arrays |= {f"{BEST}{patch.name}": np.ascontiguousarray(patch.rgb) for patch in self.best or ()}
        notes = {
            "key": self.key,
            "done": done,
            "queries_left": self._queries_left,
            "curves": self.curves,
            "judged": self.judged,
            "seconds": self.seconds,
        }
        write_whole(self.root, CHECKPOINT, to_bytes(arrays, {"notes": json.dumps(notes)}))

    def clock(self) -> float:
        """Returns the seconds spent on the attack so far, over all runs."""
        now = time.monotonic()
        self.seconds, self._since = self.seconds + now - self._since, now
        return self.seconds

    def _validate(self, done: int, patches: tuple[Patch, ...]) -> None:
        assert self.judge is not None
        harm = self.judge(patches)
        if self.log is not None:
            self.log.validated(done, harm)
        if not self.judged or _worth(harm) > max(_worth(value) for _, value in self.judged):
            self.best = patches
        self.judged.append((done, harm))
        best = max(range(len(self.judged)), key=lambda number: _worth(self.judged[number][1]))
        if self.patience and len(self.judged) - 1 - best >= self.patience:
            self.stopped = f"no better on the validation samples for {self.patience} validations"


def _best(arrays: State, *, is_judged: bool) -> tuple[Patch, ...]:
    """Returns the patches with the largest harm from the arrays of a checkpoint; an empty tuple before the first
    validation.

    Raises:
        ValueError: the arrays are not those of a checkpoint with patches.
    """
    names = sorted((name for name in arrays if name.startswith(BEST)), key=surface_of)
    if is_judged and not names:
        raise ValueError("patches were judged, and the best are not there")
    for name in names:
        if not is_picture(arrays[name]):
            raise ValueError(f"{name} is no patch")
    return tuple(Patch(name=name.removeprefix(BEST), rgb=arrays[name]) for name in names)


def _worth(harm: float) -> float:
    """Returns the harm as a comparable number; NaN, which means that it could not be measured, becomes minus
    infinity.
    """
    return -math.inf if math.isnan(harm) else harm
