"""The paper's numbers and the comparison of searches."""
