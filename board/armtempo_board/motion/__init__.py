"""One motion: check, load, start, serve, stop, samples."""
