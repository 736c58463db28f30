"""The engine `slurm`: makes samples as jobs of a SLURM cluster whose machines share the disk of the dataset.

The package submitit submits the jobs. A preempted job runs again and keeps its finished samples. The engine needs the
extra `mujoco-gear[slurm]`.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.contracts.executors import Executor, Report, Work
from gear.dataset.executors.parts import report_lost, report_part, run_part, split_in_parts
from gear.values.errors import GearError

LOGS = "gear-slurm"
"""Folder of the jobs' logs, in the current folder."""

LOCAL = ("local", "debug")
"""Special addresses of submitit: jobs run in processes of this machine (`local`), or in this process (`debug`)."""

POLL_S = 1.0
TIMEOUT_MIN = 24 * 60


@dataclass(frozen=True, slots=True, kw_only=True)
class OnSlurm:
    """An executor that makes parts of the items (samples of a split) as jobs of a SLURM cluster.

    Attributes:
        workers: number of jobs that run in parallel.
        address: name of the partition; `local` and `debug` run the jobs on this machine; None for SLURM's default.
    """

    workers: int
    address: str | None = None

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items (samples of a split): submits one job per part and waits for all jobs to end.

        Args:
            work: function that makes items on the cluster.
            indices: indices of the items.
            report: called in this process with the outcome of each item.

        Raises:
            GearError: a job ended with an error that does not concern a single item, or SLURM is not installed on this
                machine.
        """
        if not indices:
            return
        parts = split_in_parts(indices, self.workers)
        jobs = self._submitted(work, parts)
        pending = dict(zip(range(len(jobs)), jobs, strict=True))
        try:
            while pending:
                for number in [number for number, job in pending.items() if job.done()]:
                    self._report(pending.pop(number), parts[number], report)
                if pending:
                    time.sleep(POLL_S)
        finally:
            for job in pending.values():
                job.cancel()

    def _submitted(self, work: Work, parts: list[list[int]]) -> list[Any]:
        """Submits one job for each part.

        Raises:
            GearError: SLURM is not installed here.
        """
        submitit = _imported()
        cluster = self.address if self.address in LOCAL else "slurm"
        try:
            jobs = submitit.AutoExecutor(folder=Path(LOGS) / "%j", cluster=cluster)
        except RuntimeError as error:
            raise GearError(f"--engine slurm: {error}; --address local runs the jobs on this machine") from error
        jobs.update_parameters(name="gear", timeout_min=TIMEOUT_MIN, slurm_array_parallelism=self.workers)
        if self.address is not None and self.address not in LOCAL:
            jobs.update_parameters(slurm_partition=self.address)
        submitted: list[Any] = jobs.map_array(run_part, [work] * len(parts), parts)
        return submitted

    @staticmethod
    def _report(job: Any, part: Sequence[int], report: Report) -> None:
        try:
            result = job.result()
        except Exception as error:  # submitit has several kinds for jobs that failed, were lost, or ran out of time
            first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            report_lost(part, f"job {job.job_id} was lost ({first})", report)
        else:
            report_part(result, report)


def executor(*, workers: int, backend: str, address: str | None = None) -> Executor:
    """Opens the engine `slurm`; `backend` is not used.

    Raises:
        GearError: submitit is not installed.
    """
    _imported()
    return OnSlurm(workers=workers, address=address)


def _imported() -> Any:
    """The package submitit.

    Raises:
        GearError: it is not installed.
    """
    try:
        return importlib.import_module("submitit")
    except ImportError as error:
        raise GearError(f"--engine slurm needs submitit ({error}); pip install 'mujoco-gear[slurm]'") from error
