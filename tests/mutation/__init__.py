"""Small mistakes in the sources that the tests should notice: ``python -m tests.mutation``."""
