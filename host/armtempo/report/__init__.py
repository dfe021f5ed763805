"""Run folders: writing and reading them; curves, tables and pages of runs and plans."""
