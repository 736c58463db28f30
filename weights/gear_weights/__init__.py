"""Reference networks and pre-computed patches for gear, which finds them by the entry point `gear.weights`.

`FOLDER` holds `models/<model>.safetensors`, each with its card `models/<model>.md`, and `patches/<name>/`, each a patch
folder as `gear attack` writes one.
"""

from pathlib import Path

FOLDER = Path(__file__).parent
