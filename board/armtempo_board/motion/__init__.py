"""One motion: checked, loaded, started, kept supplied with steps, stopped, and sampled on its way."""
