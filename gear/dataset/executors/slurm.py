"""The engine `slurm`: makes samples as jobs of a SLURM cluster whose machines share the disk of the dataset.

The package submitit submits the jobs. A preempted job runs again and keeps its finished samples. The engine needs the
extra `mujoco-gear[slurm]`.
"""

from __future__ import annotations

import importlib
import re
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.contracts.executors import MOST_FAILURES, Executor, Needs, Report, Work
from gear.dataset.disk_errors import explained
from gear.dataset.executors.parts import report_lost, report_part, run_part, split_in_parts
from gear.dataset.executors.threads import share_of, threads_set
from gear.dataset.guarded_paths import REMEDY
from gear.values.errors import DatasetError, GearError

LOGS = "gear-slurm"
"""Folder of the jobs' logs, in the current one; each run has a folder of its own there."""

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
        gpus: number of graphics cards that each job reserves.
    """

    workers: int
    address: str | None = None
    gpus: int = 0

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes the items with the given indices in SLURM jobs, and reports the outcome of each item.

        After `MOST_FAILURES` jobs in a row that made nothing, the other jobs are cancelled.

        Args:
            work: called in each job with a part of the items.
            indices: indices of the missing items.
            report: called with one outcome for each item, in any order.

        Raises:
            GearError: a job ended with an error that does not concern a single item, or SLURM is not installed on this
                machine.
        """
        if not indices:
            return
        parts = split_in_parts(indices, self.workers)
        jobs = self._submitted(work, parts)
        pending = dict(zip(range(len(jobs)), jobs, strict=True))
        in_row = 0
        try:
            while pending and in_row < MOST_FAILURES:
                for number in [number for number, job in pending.items() if job.done()]:
                    was_made = self._report(pending.pop(number), parts[number], report)
                    in_row = 0 if was_made else in_row + 1
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
            jobs = submitit.AutoExecutor(folder=_private_folder() / "%j", cluster=cluster)
        except RuntimeError as error:
            raise GearError(f"--engine slurm: {error}; --address local runs the jobs on this machine") from error
        jobs.update_parameters(name="gear", timeout_min=TIMEOUT_MIN, slurm_array_parallelism=self.workers)
        if self.address is not None and self.address not in LOCAL:
            jobs.update_parameters(slurm_partition=self.address)
        if self.gpus and cluster == "slurm":
            jobs.update_parameters(gpus_per_node=self.gpus)
        # A job of a cluster has one core, as is SLURM's default, and takes over the variables of this process.
        with threads_set(share_of(self.workers) if cluster in LOCAL else 1):
            submitted: list[Any] = jobs.map_array(run_part, [work] * len(parts), parts)
        return submitted

    @staticmethod
    def _report(job: Any, part: Sequence[int], report: Report) -> bool:
        """Reports a job that has ended; returns whether any of its items was made.

        Raises:
            GearError: the job ended with an error that is not about a single item.
        """
        utils = importlib.import_module("submitit.core.utils")
        try:
            result = job.result()
        except utils.FailedJobError as error:  # it ran, and raised: a package is missing there, or a bug
            raise GearError(f"job {job.job_id} failed ({_cause(str(error))}); its log is {job.paths.stderr}") from error
        except Exception as error:  # submitit has several kinds for jobs that were lost, or ran out of time
            first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            report_lost(part, f"job {job.job_id} was lost ({first})", report, trace=str(error))
            return False
        return report_part(result, report)


def _private_folder() -> Path:
    """A new folder for the jobs and their logs, which nobody else can write to: submitit unpickles files from it.

    Raises:
        DatasetError: the folder of logs is a link, or cannot be made.
    """
    logs = Path(LOGS).absolute()
    with explained(logs):
        if logs.is_symlink():
            raise DatasetError(logs, f"is a link; {REMEDY}")
        logs.mkdir(exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=time.strftime("%Y%m%d-%H%M%S-"), dir=logs))


def _cause(text: str) -> str:
    """The last line of the trace in the text of submitit's `FailedJobError`, which stands between two rules."""
    parts = re.split(r"^-{10,}$", text, flags=re.MULTILINE)
    lines = [line.strip() for line in parts[1 if len(parts) > 1 else 0].splitlines() if line.strip()]
    return lines[-1] if lines else "without a trace"


def executor(*, workers: int, backend: str, address: str | None, needs: Needs) -> Executor:
    """Opens the engine `slurm`, which makes samples as jobs of a SLURM cluster.

    Args:
        workers: number of jobs that run in parallel.
        backend: ignored.
        address: name of the partition; `local` and `debug` run the jobs on this machine; None for SLURM's default.
        needs: `gpus` is the number of graphics cards that each job reserves; `silence_s` is ignored.

    Raises:
        GearError: submitit is not installed.
    """
    _imported()
    return OnSlurm(workers=workers, address=address, gpus=needs.gpus)


def _imported() -> Any:
    """The package submitit.

    Raises:
        GearError: it is not installed.
    """
    try:
        return importlib.import_module("submitit")
    except ImportError as error:
        raise GearError(f"--engine slurm needs submitit ({error}); pip install 'mujoco-gear[slurm]'") from error
