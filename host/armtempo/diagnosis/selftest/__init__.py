"""The board's self-test: code that is sent to MicroPython's REPL, measures, and is removed."""
