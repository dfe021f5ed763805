"""A board in use: configure, home, move, replay, record, stop."""
