"""MicroPython's stm32 port: boot, prompt, serial port, and the objects of its modules."""
