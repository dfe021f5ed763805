"""Builds the virtual board as its options say."""

from binascii import unhexlify

from simulator import edgelog, flash, motors, pace, serial, the
from simulator.board import TICKS_PER_MS, Board

_POWER_ON = 1


def power_up(options, cause):
    """A new board; the flash's folder, the serial line and the edge log's file outlive it."""
    the.options = options
    the.settings = {"reset_cause": cause, "unique_id": unhexlify(options["unique_id"])}
    board = Board(options["dma_preload"])
    the.board = board
    if the.serial is None:
        the.serial = serial.Serial()
    the.serial.reset()
    the.pace = pace.Pace(board, the.serial, options["speed"])
    the.port = serial.USB_VCP()
    cut_at = options["power_cut_at"] if cause == _POWER_ON else 0
    the.flash = flash.Flash(options["flash"], options["program"], _stall, cut_at)
    if options["edge_log"]:
        if the.edges is None:
            the.edges = edgelog.EdgeLog(options["edge_log"])
        the.edges.listen(board)


def connect(pins):
    """Put motors and encoders on the pins; ``pins`` is the board program's own table."""
    arm = the.options["arm"]
    if not arm:
        return
    board = the.board
    enable = motors.Enable(board, pins.ENABLE, arm["enable_high"])
    joints = []
    for joint in arm["joints"]:
        step, direction = pins.STEP[joint["channel"]][0], pins.STEP[joint["channel"]][6]
        timer = pins.ENCODER[joint["encoder"]][0] if joint["encoder"] < len(pins.ENCODER) else None
        encoder = board.timers[timer] if timer else None
        motor = motors.Motor(board.pins.line(direction), enable, encoder, joint)
        board.pins.line(step).sinks.append(motor)
        joints.append(motor)
    the.arm = motors.Arm(board, joints)


def _stall(ms):
    """The processor stands still so long; the timers do not."""
    the.board.stand_still(ms * TICKS_PER_MS)
