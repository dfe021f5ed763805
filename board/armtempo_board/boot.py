"""Becomes ``/flash/boot.py``: USB shows a serial port only, so that no host writes the flash behind us."""

import pyb

pyb.Pin("A15", pyb.Pin.OUT_PP, value=0)  # STEP 1, low before all else: a JTAG pin, which a reset pulls up
pyb.usb_mode("VCP")

try:
    from armtempo_board import keep_watchdog_fed

    keep_watchdog_fed()
except ImportError:  # the program is not, or not wholly, deployed
    pass
