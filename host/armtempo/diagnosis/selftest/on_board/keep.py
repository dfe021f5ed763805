"""Stores the measured step rates, which the program states after its next start."""


def measure(root, program_crc, rates):
    """``rates``: of one joint, of all together, and the number of joints with which they were measured."""
    import os

    from armtempo_board.app.board import board_id
    from armtempo_board.storage import measured_rates

    measured_rates.write(root, board_id(), program_crc, rates)
    if hasattr(os, "sync"):
        os.sync()  # a reset follows
    return {}
