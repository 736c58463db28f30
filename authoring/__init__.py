"""Scripts that make gear's assets: every mesh and texture under `mjcf/` comes from here, the same bytes each time.

Vertices are quantised. Still, OpenBLAS multiplies matrices by kernels of the processor's own, which differ in the last
bit, and a vertex that lies between two steps then goes to one or the other. So it is asked for the same kernels on
every x86-64, before NumPy is imported; those of Haswell run wherever there is AVX2.
"""

import os

KERNELS = "OPENBLAS_CORETYPE"

os.environ.setdefault(KERNELS, "Haswell")
