"""Makes the outputs and inputs of an arm."""

from array import array

from armtempo_shared.table import rows
from pyb import Pin, Timer

from armtempo_board.app import output_commands
from armtempo_board.hardware import pins
from armtempo_board.hardware.digital_inputs import DigitalInputs
from armtempo_board.hardware.outputs import Outputs

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from armtempo_board.app.board import Board
    from armtempo_board.hardware.digital_inputs import DigitalInputs
    from armtempo_board.hardware.outputs import Outputs

    Rows = list[dict[str, int]]


def attach(board: "Board", outputs: "Rows", inputs: "Rows") -> None:
    """Give the board the outputs, with their safe values, the inputs, and their commands.

    ``outputs``, ``inputs``: rows of the arm record (``armrecord.OUTPUT``, ``INPUT``).
    """
    board.outputs = outputs_of(outputs)
    board.inputs = inputs_of(inputs)
    handlers = output_commands.output, output_commands.inputs_and_outputs
    for (_, number, fields, _, tail), (_, _, values, _, _), handler in zip(rows("O"), rows("P"), handlers):
        board.extra_commands[number] = (handler, fields, values, tail)


def outputs_of(table: "Rows") -> "Outputs":
    """The outputs of an arm, set to their safe values."""
    numbers = array("H")
    for row in table:
        numbers.extend(array("H", [row["low"], row["high"], row["safe"]]))
    outputs = Outputs(numbers)
    timers: "dict[int, Timer]" = {}
    for number, row in enumerate(table):
        pin = Pin(pins.name(row["pin"]))
        outputs.held.append(pin)
        level: "list[int]" = []  # where its safe value would be written, before there is anything to take it
        outputs.writes.append(level.append)
        outputs.set(number, row["safe"])
        outputs.writes[number] = _driven(pin, row, level.pop(), timers)
    outputs.held.extend(timers.values())
    return outputs


def _driven(
    pin: Pin, row: "dict[str, int]", level: int, timers: "dict[int, Timer]"
) -> "Callable[[int], Any]":
    """The function that sets level or pulse width; a bound method, made once, as that allocates."""
    if not row["timer"]:
        pin.init(Pin.OUT_PP, value=level)
        return pin.value
    timer = timers.get(row["timer"])
    if timer is None:
        timer = Timer(row["timer"], prescaler=row["prescaler"], period=row["period"])
        timers[row["timer"]] = timer
    return timer.channel(row["channel"], Timer.PWM, pin=pin, pulse_width=level).pulse_width


def inputs_of(table: "Rows") -> "DigitalInputs":
    """The inputs of an arm, with their present levels."""
    found = []
    numbers = array("I")
    for row in table:
        pull = Pin.PULL_DOWN if row["active_high"] else Pin.PULL_UP
        found.append(Pin(pins.name(row["pin"]), Pin.IN, pull=pull))
        numbers.extend(array("I", [row["active_high"], row["debounce_ms"], 0]))
    inputs = DigitalInputs(found, numbers)
    for number, pin in enumerate(found):
        inputs.levels |= (pin.value() == table[number]["active_high"]) << number
    return inputs
