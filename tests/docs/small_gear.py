"""Stands in for the command `gear` when the documents' blocks run: the same command, at a small size.

python tests/docs/small_gear.py collect --task semseg --out data/b01
"""

from __future__ import annotations

import sys

from gear.cli.main import main

SMALL = {
    "collect": "--samples 1 --quality fast --set options.width_px=256 --set options.height_px=128",
    "attack": "--steps 2",
    "train": "--set epochs=1 --set batch=1",
}
"""Flags that are put behind those of the block, by command. The last one of a kind wins."""

if __name__ == "__main__":
    command = sys.argv[1] if len(sys.argv) > 1 else ""
    sys.exit(main([*sys.argv[1:], *SMALL.get(command, "").split()]))
