"""The board program: MicroPython for the STM32F407."""
