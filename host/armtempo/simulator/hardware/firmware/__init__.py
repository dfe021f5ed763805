"""What MicroPython's stm32 port does: boot, prompt, the serial port, and its modules' objects."""
