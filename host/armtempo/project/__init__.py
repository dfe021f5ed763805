"""The project folder: ``armtempo.toml`` names arm, port, job and run folder; and which board is meant without it."""
