"""Becomes ``/flash/boot.py``: USB has a serial port only, so that no host writes to the flash."""

import pyb

pyb.Pin("A15", pyb.Pin.OUT_PP, value=0)  # STEP 1 low at once: a reset pulls the JTAG pin up
pyb.usb_mode("VCP")

try:
    import armtempo_sectors  # noqa: F401  where the program is not in the firmware
except Exception:
    pass
try:
    from armtempo_board import keep_watchdog_fed

    keep_watchdog_fed()
except Exception:  # not deployed, or incomplete
    pass
