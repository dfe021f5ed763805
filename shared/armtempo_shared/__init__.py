"""Definitions of host and board; for CPython and MicroPython, without numpy."""
