"""Stores the step rates that were measured: the program states them from its next start on."""


def measure(root, program_crc, rates):
    """``rates``: of one joint, of all together, of how many joints they were measured."""
    import os

    from armtempo_board.app.board import board_id
    from armtempo_board.storage import measured_rates

    measured_rates.write(root, board_id(), program_crc, rates)
    if hasattr(os, "sync"):
        os.sync()  # a reset comes
    return {}
