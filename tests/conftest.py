"""For every test: torch keeps to one thread, so that tests beside each other do not wait for each other's threads.

NumPy is to multiply matrices as it does when assets are made.
"""

from __future__ import annotations

import os

import authoring

os.environ.setdefault("OMP_NUM_THREADS", "1")
assert authoring.KERNELS in os.environ
