"""The program above a motion: its loop, the host's commands, events and samples, button and LEDs."""
