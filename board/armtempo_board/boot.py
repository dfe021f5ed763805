"""Becomes ``/flash/boot.py``: USB shows a serial port only, so that no host writes the flash while the program runs."""

import pyb

pyb.Pin("A15", pyb.Pin.OUT_PP, value=0)  # STEP 1, low before all else: a JTAG pin, which a reset pulls up
pyb.usb_mode("VCP")

try:
    import armtempo_archive  # noqa: F401  finds the program where it is no part of the firmware
except Exception:  # it is, or its archive is not, or not wholly, deployed
    pass
try:
    from armtempo_board import keep_watchdog_fed

    keep_watchdog_fed()
except Exception:  # the same of the program
    pass
