"""Errors, the array type, progress, version, settings; files: TOML, JSON, text tables, written whole or not at all."""
