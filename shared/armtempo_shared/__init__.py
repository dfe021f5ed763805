"""Definitions shared by host and board; runs on CPython and MicroPython, without numpy."""
