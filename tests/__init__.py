"""All tests."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""Before numpy is loaded: on matrices as small as ours, threads only cost time."""
