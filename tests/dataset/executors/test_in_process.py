"""The engine that is this process keeps an engine's promises."""

from __future__ import annotations

import pytest

from gear.contracts.executors import Executor
from gear.dataset.executors.in_process import InThisProcess
from gear.testing.executor_contract import ExecutorContract


class TestInThisProcess(ExecutorContract):
    @pytest.fixture
    def executor(self) -> Executor:
        return InThisProcess()
