"""What a user's program may not call of MicroPython: it would keep the board from its work, or take what the arm uses.

Found in the text, by the names of modules, also imported ones. Pins and timers that are no numbers or texts there are
looked at when the program takes them, by marks (``user_program``).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

from armtempo.model import engine_pins, pin_use
from armtempo.model.boards import BOARDS
from armtempo.model.pin_use import PinUser

_LASTS = "{call} keeps the board from its work", "write {cell}.sleep(seconds)"
_RESTARTS = "{call} restarts the board, and the arm's position is lost", "end the program with sys.exit()"
_STOPS = "{call} stops the steps", "leave it out"
_LINK = (
    "{call} takes the link to the host",
    "show values with print, and read inputs with {cell}.active(name)",
)
_DMA = (
    "{call} switches off the clock of the DMA that makes the steps",
    "use machine.I2C, or machine.SoftSPI",
)
_OWN_WATCHDOG = "{call}: the board has a watchdog of its own, which this would replace", "leave it out"
_THREADS = (
    "{call}: MicroPython has no threads on the board",
    "use asyncio, or act between the calls of the cell",
)
_SERVO = "{call} takes timer 5, which makes the steps", "give the servo as an output in the arm file"
_REFUSED = {
    "time.sleep": _LASTS,
    "time.sleep_ms": _LASTS,
    "pyb.delay": _LASTS,
    "machine.reset": _RESTARTS,
    "machine.soft_reset": _RESTARTS,
    "machine.bootloader": _RESTARTS,
    "pyb.hard_reset": _RESTARTS,
    "pyb.bootloader": _RESTARTS,
    "machine.sleep": _STOPS,
    "machine.lightsleep": _STOPS,
    "machine.deepsleep": _STOPS,
    "machine.disable_irq": _STOPS,
    "machine.freq": _STOPS,
    "pyb.stop": _STOPS,
    "pyb.standby": _STOPS,
    "pyb.disable_irq": _STOPS,
    "pyb.freq": _STOPS,
    "pyb.USB_VCP": _LINK,
    "pyb.usb_mode": _LINK,
    "pyb.repl_uart": _LINK,
    "os.dupterm": _LINK,
    "machine.SPI": _DMA,
    "pyb.SPI": _DMA,
    "pyb.I2C": _DMA,
    "pyb.DAC": _DMA,
    "pyb.Servo": _SERVO,
    "machine.WDT": _OWN_WATCHDOG,
    "pyb.WDT": _OWN_WATCHDOG,
    "_thread.start_new_thread": _THREADS,
}
_PINS = ("machine.Pin", "pyb.Pin", "machine.ADC", "pyb.ADC", "pyb.ExtInt")
_TIMER = "pyb.Timer"
_BUILT_IN = ("input", "exec", "eval")
FLASH = ("os.remove", "os.unlink", "os.rename", "os.mkdir", "os.rmdir", "os.sync", "os.umount")
"""Calls that write to the flash."""
_OWN = ("armtempo_board", "armtempo_shared")
_COROUTINE = "serve"


@dataclass(frozen=True)
class CallProblem:
    """A call, or an import, that a program may not make."""

    line: int
    what: str
    next_step: str


def problems(tree: ast.Module, arm: PinUser, cell: str) -> Iterator[CallProblem]:
    """All, in the order of ``ast.walk``; ``cell``: its name in the program."""
    names = imported(tree)
    tasks = {node.name for node in tree.body if isinstance(node, ast.AsyncFunctionDef)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from _of_import(node)
        elif isinstance(node, ast.Await):
            yield from _of_await(node, cell)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            yield from _never_awaited(node.value, tasks, cell)
        elif isinstance(node, ast.Call):
            called = dotted(node.func, names)
            yield from _of_call(node, called, arm, cell)


def imported(tree: ast.Module) -> dict[str, str]:
    """What the names are that a program imports: "time" or "time.sleep", also of MicroPython's old names ("utime")."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                found[alias.asname or alias.name] = _plain(alias.name)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                found[alias.asname or alias.name] = f"{_plain(node.module)}.{alias.name}"
    return found


def _plain(module: str) -> str:
    return module[1:] if module in ("utime", "uos", "umachine") else module


def dotted(node: ast.expr, names: dict[str, str]) -> str:
    """The full name of what is called; "" if it is not one that was imported, or built in."""
    if isinstance(node, ast.Name):
        return names.get(node.id, node.id if node.id in _BUILT_IN else "")
    if isinstance(node, ast.Attribute):
        base = dotted(node.value, names)
        return base and f"{base}.{node.attr}"
    return ""


def _of_import(node: ast.Import | ast.ImportFrom) -> Iterator[CallProblem]:
    if isinstance(node, ast.Import):
        modules = [alias.name for alias in node.names]
    else:
        modules = [f"{node.module}.{alias.name}" for alias in node.names]
    for module in modules:
        if module.partition(".")[0] in _OWN and module != f"{_OWN[0]}.cell":
            yield CallProblem(
                node.lineno,
                f"{module} is the board's own, not for programs",
                f"import the cell alone: from {_OWN[0]} import cell",
            )


def _of_await(node: ast.Await, cell: str) -> Iterator[CallProblem]:
    if (name := _of_cell(node.value, cell)) and name != _COROUTINE:
        yield CallProblem(
            node.lineno,
            f"{cell}.{name} is no coroutine: other tasks do not run while it waits for the arm",
            f"leave await out; goto with wait=False, and wait for the end by: while {cell}.moving(): await "
            "asyncio.sleep(0)",
        )


def _never_awaited(call: ast.Call, tasks: set[str], cell: str) -> Iterator[CallProblem]:
    is_task = isinstance(call.func, ast.Name) and call.func.id in tasks
    if is_task or _of_cell(call, cell) == _COROUTINE:
        what = ast.unparse(call)
        yield CallProblem(
            call.lineno,
            f"{what} does nothing, as it is a coroutine",
            f"write await {what}, asyncio.create_task({what}), or asyncio.run({what})",
        )


def _of_cell(node: ast.expr, cell: str) -> str:
    """The name of the call of the cell; "" if it is none."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        base = node.func.value
        return node.func.attr if isinstance(base, ast.Name) and base.id == cell else ""
    return ""


def _of_call(node: ast.Call, called: str, arm: PinUser, cell: str) -> Iterator[CallProblem]:
    if called == "input":
        yield CallProblem(
            node.lineno,
            "input() waits for a terminal, which the board does not have",
            f"wait for an input of the arm file: {cell}.wait(name)",
        )
    elif called in _BUILT_IN:
        yield CallProblem(
            node.lineno,
            f"{called}() runs a text in which the board cannot do its work, nor tell the line",
            "write it into the program",
        )
    elif called in _REFUSED:
        what, next_step = _REFUSED[called]
        yield CallProblem(node.lineno, what.format(call=called), next_step.format(cell=cell))
    elif called in _PINS and node.args:
        pin = _pin(node.args[0])
        if use := _uses(arm).get(pin):
            yield CallProblem(
                node.lineno,
                f"{called}: {pin} is {use}",
                f"take another pin ('armtempo help hardware' lists what is free), or {cell}.set and {cell}.active for "
                "what the arm file names",
            )
    elif called == _TIMER and node.args:
        number = node.args[0]
        timers = engine_pins.taken_timers(arm)
        timers |= {place.timer: f"output {name!r}" for name, place in pin_use.timer_outputs(arm).items()}
        if isinstance(number, ast.Constant) and isinstance(number.value, int) and number.value in timers:
            yield CallProblem(
                node.lineno,
                f"{called}: timer {number.value} is taken for {timers[number.value]}",
                f"take another timer, or machine.Timer(-1); taken are {', '.join(map(str, sorted(timers)))}",
            )


def _pin(node: ast.expr) -> str:
    """ "PA15" of "PA15", "A15", Pin.board.PA15 and Pin.cpu.A15."""
    text = (
        node.value if isinstance(node, ast.Constant) else node.attr if isinstance(node, ast.Attribute) else ""
    )
    return f"P{text.removeprefix('P')}" if isinstance(text, str) else ""


def takes(called: str) -> bool:
    """Whether what is called takes a pin or a timer."""
    return called in _PINS or called == _TIMER


def taken(arm: PinUser) -> list[str | int]:
    """The pins and timers of an arm, and of its outputs and inputs, as the board names them."""
    timers = {*engine_pins.taken_timers(arm), *(place.timer for place in pin_use.timer_outputs(arm).values())}
    return [*sorted(pin.removeprefix("P") for pin in _uses(arm)), *sorted(timers)]


def _uses(arm: PinUser) -> dict[str, str]:
    """Of each pin that is not for a program."""
    found = {entry.pin: f"input {entry.name!r} of the arm" for entry in arm.inputs}
    found |= {output.pin: f"output {output.name!r} of the arm" for output in arm.outputs}
    found |= {pin: f"taken by {use}" for pin, use in BOARDS[arm.board].taken.items()}
    return found | {pin: f"taken for {use}" for pin, use in engine_pins.taken_pins(arm).items()}
