"""Models of the STM32F407's peripherals, and virtual time; run under MicroPython and CPython alike."""
