"""From a URDF robot description to an arm file: read, derive the rows, hold them against the URDF, write."""
