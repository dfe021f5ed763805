"""Builds the virtual board from its options."""

import sys
from binascii import unhexlify

import arm  # noqa: F401  its modules are loaded later, when this folder is no longer on the path
import edge_writer
import injected_faults
import machine_state
import pace
from chip import flash, last_sectors
from chip.processor import TICKS_PER_MS, Chip
from firmware import boot, usb_serial

_ARM_RECORD = "/armtempo/arm.ata"


def power_up(options, cause):
    """Make a new board; the flash's folder, the serial line and the edge log are kept over resets.

    Returns the mode in which it starts, of ``firmware.boot``.
    """
    first = machine_state.flash is None
    machine_state.options = options
    machine_state.settings = {"reset_cause": cause, "unique_id": unhexlify(options["unique_id"])}
    board = Chip(options["dma_preload"])
    machine_state.board = board
    if options["edge_log"]:
        if machine_state.edges is None:
            machine_state.edges = edge_writer.EdgeLog(options["edge_log"])
        machine_state.edges.listen(board)
    mode = boot.choose_mode(board, options["button_ms"] if first else 0)
    if machine_state.serial is None:
        machine_state.serial = usb_serial.Serial()
    machine_state.serial.reset()
    machine_state.pace = pace.Pace(board, machine_state.serial, options["speed"])
    machine_state.port = usb_serial.USB_VCP()
    cut_at = options["power_cut_at"] if first else 0  # only once
    damage = options["damage"] if first else machine_state.flash.damage
    root, programs = options["flash"], options["program"]
    blocks = options["flash_blocks"] or flash.BLOCKS
    machine_state.flash = flash.FlashFolder(root, blocks, programs, _stall, cut_at, damage)
    machine_state.flash.sectors = board.sectors = last_sectors.Sectors(machine_state.flash, root + ".sectors")
    injected_faults.Faults(board, options["faults"])
    return mode


def learn(folders):
    """Load the pin table and the layout of the arm record from ``folders``, whatever is in the board's flash."""
    path = list(sys.path)
    sys.path[0:0] = folders
    from arm import motors  # noqa: F401  with its armrecord
    from armtempo_board.hardware import pins

    sys.path[:] = path
    machine_state.pins = pins
    for name in list(sys.modules):
        if name.split(".")[0] in ("armtempo_board", "armtempo_shared"):
            del sys.modules[name]


def connect(pins):
    """Connect motors and encoders to the pins; ``pins``: the board program's table."""
    from arm import motors

    angles = [motor.angle_deg() for motor in machine_state.arm.motors] if machine_state.arm else ()
    machine_state.arm = motors.ArmOnPins(
        machine_state.board, pins, _arm_record, machine_state.options["seed"], angles
    )
    machine_state.flash.renamed = machine_state.arm.connect


def _arm_record():
    """(head, joints) of the arm in the options or of the record in the flash, or None."""
    from arm.motors import armrecord

    given = machine_state.options["arm"]
    if given:
        return given["head"], given["joints"]
    try:
        with flash.real_open(machine_state.options["flash"] + _ARM_RECORD, "rb") as file:
            head, joints, _ = armrecord.unpack(file.read())
    except (OSError, ValueError):
        return None
    return head, joints


def _stall(ms):
    """Halt the processor, but not the timers, while the flash is written."""
    if not machine_state.options["instant_flash"]:
        machine_state.board.stall(int(ms * TICKS_PER_MS))
        machine_state.pace.stall(ms)
