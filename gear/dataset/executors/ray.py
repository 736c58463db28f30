"""The engine `ray`: tasks on a Ray cluster whose machines share the disk of the dataset. Needs `mujoco-gear[ray]`."""

from __future__ import annotations

import importlib
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gear.contracts.executors import MOST_FAILURES, Executor, Report, Work
from gear.dataset.executors.parts import report_lost, report_part, run_part, split_in_parts
from gear.values.errors import GearError

RETRIES = 5
"""How often Ray starts a part again whose worker or machine was lost."""


ANSWER_S = 10.0
"""Seconds in which a cluster must answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OnRay:
    """Tasks on a Ray cluster.

    Attributes:
        workers: number of parts that are made at a time; each takes one core of the cluster.
        address: of the cluster; None for one that is started on this machine.
    """

    workers: int
    address: str | None = None

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """As `Executor.run`. Parts of lost machines start again elsewhere.

        Raises:
            GearError: the first one of a part, or there is no cluster at the address.
        """
        if not indices:
            return
        ray = _imported()
        is_ours = not ray.is_initialized()
        if is_ours:
            self._connect(ray)
        try:
            self._run_parts(ray, work, split_in_parts(indices, self.workers), report)
        finally:
            if is_ours:
                ray.shutdown()

    def _connect(self, ray: Any) -> None:
        """Joins the cluster, or starts one.

        Raises:
            GearError: there is none at the address.
        """
        self._check_address()
        local = {"num_cpus": self.workers, "include_dashboard": False} if self.address is None else {}
        try:
            ray.init(address=self.address or "local", log_to_driver=False, logging_level="ERROR", **local)
        except (ConnectionError, ValueError, RuntimeError) as error:
            problem = str(error).splitlines()[0] if str(error) else type(error).__name__
            where = f"--address {self.address}: no Ray cluster can be joined there"
            raise GearError(f"{where if self.address else 'Ray cannot start on this machine'} ({problem})") from error

    def _check_address(self) -> None:
        """Checks that somebody answers at the address: Ray would wait for minutes.

        Raises:
            GearError: nobody does.
        """
        host, _, port = (self.address or "").removeprefix("ray://").rpartition(":")
        if not (host and port.isdecimal()):  # `auto` and the like
            return
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=ANSWER_S).close()
        except (OSError, OverflowError) as error:
            problem = f"--address {self.address}: no Ray cluster can be joined there ({error})"
            raise GearError(problem) from error

    def _run_parts(self, ray: Any, work: Work, parts: list[list[int]], report: Report) -> None:
        """Keeps as many parts at work as there are workers, until all are made or too many fail in a row."""
        remote = ray.remote(num_cpus=1, max_retries=RETRIES, scheduling_strategy="SPREAD")(run_part)
        shared = ray.put(work)
        running: dict[Any, list[int]] = {}
        pending, failed = list(reversed(parts)), 0
        while running or (pending and failed < MOST_FAILURES * self.workers):
            while pending and len(running) < self.workers and failed < MOST_FAILURES * self.workers:
                part = pending.pop()
                running[remote.remote(shared, part)] = part
            done, _ = ray.wait(list(running), num_returns=1)
            part = running.pop(done[0])
            try:
                result = ray.get(done[0])
            except ray.exceptions.RayTaskError:  # a fault of gear, or of a plugin that is not about a sample
                raise
            except ray.exceptions.RayError as error:  # the worker or the machine was lost too often
                report_lost(part, f"a worker of the cluster was lost ({type(error).__name__})", report)
                failed += len(part)
            else:
                failed = 0 if report_part(result, report) else failed + len(part)


def executor(*, workers: int, backend: str, address: str | None = None) -> Executor:
    """The engine, as `open_engine` asks for it.

    Raises:
        GearError: Ray is not installed.
    """
    _imported()
    return OnRay(workers=workers, address=address)


def _imported() -> Any:
    """Ray itself.

    Raises:
        GearError: it is not installed.
    """
    try:
        return importlib.import_module("ray")
    except ImportError as error:
        raise GearError(f"--engine ray needs Ray ({error}); pip install 'mujoco-gear[ray]'") from error
