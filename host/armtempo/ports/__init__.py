"""Serial ports: their names, and which there are."""
