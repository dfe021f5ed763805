"""A MicroPython firmware that has the board program in it.

::

    frozen.py    the program's sources, their hash and a manifest as a folder for MicroPython's build
    manifest.py  the manifest; it runs in MicroPython's build, not here
    checkout.py  what a MicroPython checkout has: version, boards, submodules
    build.py     the compilers; one board's firmware, built and put into a folder
    image.py     that folder: the pieces of the flash, and what they are
    write.py     onto the board, by dfu-util or st-flash
"""
