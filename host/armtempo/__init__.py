"""Time-optimal B-spline motions for stepper arms on an STM32F407 with MicroPython."""

__version__ = "0.1.0"
