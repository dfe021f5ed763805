"""The chip: pins, timers, DMA streams and the interrupt code."""
