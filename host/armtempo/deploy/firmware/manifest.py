"""For MicroPython's FROZEN_MANIFEST: what the board's firmware has anyway, and the board program next to this file.

``opt=1``: no assertions; line numbers stay, as they take flash only.
"""

include("$(PORT_DIR)/boards/manifest.py")
package("armtempo_board", opt=1)
package("armtempo_shared", opt=1)
