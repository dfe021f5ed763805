"""Builds the virtual board as its options say."""

import sys
from binascii import unhexlify

from simulator import edgelog, faults, firmware, flash, pace, serial, the
from simulator.board import TICKS_PER_MS, Board

_ARM_RECORD = "/armtempo/arm.ata"


def power_up(options, cause):
    """A new board; the flash's folder, the serial line and the edge log's file outlive it.

    Returns the mode of ``firmware`` in which it starts.
    """
    first = the.flash is None
    the.options = options
    the.settings = {"reset_cause": cause, "unique_id": unhexlify(options["unique_id"])}
    board = Board(options["dma_preload"])
    the.board = board
    if options["edge_log"]:
        if the.edges is None:
            the.edges = edgelog.EdgeLog(options["edge_log"])
        the.edges.listen(board)
    mode = firmware.choose_mode(board, options["button_ms"] if first else 0)
    if the.serial is None:
        the.serial = serial.Serial()
    the.serial.reset()
    the.pace = pace.Pace(board, the.serial, options["speed"])
    the.port = serial.USB_VCP()
    cut_at = options["power_cut_at"] if first else 0  # the power fails once
    damage = options["damage"] if first else the.flash.damage
    root, blocks, programs = options["flash"], options["flash_blocks"], options["program"]
    the.flash = flash.Flash(root, blocks, programs, _stall, cut_at, damage)
    faults.Faults(board, options["faults"])
    return mode


def learn(folders):
    """What the world around the board has to know, from the sources in ``folders``, whatever the board has."""
    path = list(sys.path)
    sys.path[0:0] = folders
    from armtempo_board import pins

    from simulator import motors  # noqa: F401  with its armrecord

    sys.path[:] = path
    the.pins = pins
    for name in list(sys.modules):
        if name.split(".")[0] in ("armtempo_board", "armtempo_shared"):
            del sys.modules[name]


def connect(pins):
    """Put motors and encoders on the pins; ``pins`` is the board program's own table."""
    from simulator import motors

    angles = [motor.angle_deg() for motor in the.arm.motors] if the.arm else ()
    the.arm = motors.Arm(the.board, pins, _arm_record, the.options["seed"], angles)
    the.flash.renamed = the.arm.connect


def _arm_record():
    """(head, joints) of the arm that the options or the record in the flash describe, or None."""
    from simulator.motors import armrecord

    arm = the.options["arm"]
    if arm:
        return arm["head"], arm["joints"]
    try:
        with flash.real_open(the.options["flash"] + _ARM_RECORD, "rb") as file:
            head, joints, _ = armrecord.unpack(file.read())
    except (OSError, ValueError):
        return None
    return head, joints


def _stall(ms):
    """The processor stands still so long; the timers do not."""
    the.board.stand_still(ms * TICKS_PER_MS)
