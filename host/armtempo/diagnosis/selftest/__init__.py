"""The board's self-test: code is sent to MicroPython's prompt, measures, and is removed again."""
