"""Models of the STM32F407's peripherals; run under MicroPython and CPython alike."""
