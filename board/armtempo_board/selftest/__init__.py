"""The board measures itself: parts that a host runs at the prompt, with the program in the firmware (``run.py``)."""
