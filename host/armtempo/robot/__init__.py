"""What is done with a board: configure, home, move, replay, stop."""
