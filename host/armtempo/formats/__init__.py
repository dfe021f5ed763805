"""Files in general: TOML tables, JSON, text tables, and writing a file whole or not at all."""
