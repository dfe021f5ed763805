"""Pins, timers and DMA streams of the board (STM32F4DISC): the only home of these facts.

Free of USB, SWD, REPL and LEDs. Streams: RM0090 10.3.3; alternate functions: STM32F407
data sheet, table 9.
"""

STEP = (
    # STEP pin, timer, its channel, alternate function, DMA1 stream, DMA channel, DIR pin
    ("A15", 2, 1, 1, 5, 3, "E7"),
    ("A1", 2, 2, 1, 6, 3, "E8"),
    ("B10", 2, 3, 1, 1, 3, "E10"),
    ("A2", 5, 3, 2, 0, 6, "E13"),
    ("A3", 5, 4, 2, 3, 6, "E14"),
    ("A0", 5, 1, 2, 2, 6, "E6"),  # takes the replay button's pin
)
ENCODER = (
    # timer, its channel 1 pin, its channel 2 pin, alternate function
    (1, "E9", "E11", 1),
    (3, "B4", "B5", 2),
    (8, "C6", "C7", 3),
    (4, "B6", "B7", 2),
)
ENABLE = "E12"
ESTOP = "E15"
LIMIT = ("D8", "D9", "D10")
BUTTON = "A0"  # not together with the STEP of channel 6
LEDS = ("D12", "D13", "D14", "D15")  # green, orange, red, blue
