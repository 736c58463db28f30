"""For every test: torch keeps to one thread, so that tests beside each other do not wait for each other's threads."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
