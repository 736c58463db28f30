"""The engine `ray`: makes samples on a Ray cluster whose machines share the disk of the dataset.

It needs the extra `mujoco-gear[ray]`.
"""

from __future__ import annotations

import importlib
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gear.contracts.executors import MOST_FAILURES, Executor, Needs, Report, Work
from gear.dataset.executors.parts import report_lost, report_part, run_part, split_in_parts
from gear.dataset.executors.threads import share_of, thread_variables
from gear.values.errors import GearError
from gear.values.machine import cores

RETRIES = 5
"""Number of times that Ray restarts a part after its worker or machine was lost."""


ANSWER_S = 10.0
"""Seconds within which the cluster must accept a connection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OnRay:
    """An executor that makes parts of the items (samples of a split) as tasks on a Ray cluster.

    Attributes:
        workers: number of parts that are made in parallel; each takes one core of the cluster.
        address: address of the cluster; None starts a local cluster on this machine.
        gpus: number of graphics cards that each part takes of the cluster.
    """

    workers: int
    address: str | None = None
    gpus: int = 0

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items (samples of a split) in parts; parts of lost machines start again on other machines.

        Args:
            work: function that makes items on the cluster.
            indices: indices of the items.
            report: called in this process with the outcome of each item.

        Raises:
            GearError: a part ended with an error that does not concern a single item, or there is no cluster at the
                address.
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
        """Joins the cluster at the address, or starts a local cluster.

        Raises:
            GearError: there is no cluster at the address.
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
        """Checks that a server accepts connections at the address, because Ray would wait for minutes.

        Raises:
            GearError: no server accepts a connection.
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
        # On a cluster a part has one core; a cluster that is started here shares this machine's cores.
        threads = (share_of(self.workers) or cores()) if self.address is None else 1
        settings = {
            "num_cpus": 1,
            "num_gpus": self.gpus,
            "max_retries": RETRIES,
            "scheduling_strategy": "SPREAD",
        }
        remote = ray.remote(**settings, runtime_env={"env_vars": thread_variables(threads)})(run_part)
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


def executor(*, workers: int, backend: str, address: str | None, needs: Needs) -> Executor:
    """Opens the engine `ray`, which makes samples on a Ray cluster.

    Args:
        workers: number of parts of the samples that are made in parallel.
        backend: ignored.
        address: address of the cluster; None starts a local cluster on this machine.
        needs: `gpus` is the number of graphics cards that each part takes of the cluster; `silence_s` is ignored.

    Raises:
        GearError: Ray is not installed.
    """
    _imported()
    return OnRay(workers=workers, address=address, gpus=needs.gpus)


def _imported() -> Any:
    """Ray itself.

    Raises:
        GearError: it is not installed.
    """
    try:
        return importlib.import_module("ray")
    except ImportError as error:
        raise GearError(f"--engine ray needs Ray ({error}); pip install 'mujoco-gear[ray]'") from error
