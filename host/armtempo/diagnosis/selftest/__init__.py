"""The board measures itself: what is measured runs at MicroPython's prompt, is sent from here, and is dropped again."""
