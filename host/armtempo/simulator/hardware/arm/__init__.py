"""The arm on the board's pins: motors, encoders, limit switches."""
