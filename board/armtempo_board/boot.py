"""Becomes ``/flash/boot.py``: USB shows a serial port only, so that no host writes the flash behind us."""

import pyb

pyb.usb_mode("VCP")

try:
    from armtempo_board import keep_watchdog_fed

    keep_watchdog_fed()
except ImportError:  # the program is not, or not wholly, deployed
    pass
