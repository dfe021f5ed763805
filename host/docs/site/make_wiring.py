"""The wiring diagram, board/docs/images/wiring.svg, drawn of the board program's table of pins.

``python host/docs/site/make_wiring.py`` writes it; a test compares it with the table.
"""

from __future__ import annotations

from html import escape
from pathlib import Path

from armtempo.model import engine_pins

TARGET = Path(__file__).parents[3] / "board" / "docs" / "images" / "wiring.svg"
ROW, WIDTH, TOP = 24, 900, 56
BOARD = (330, 240)
"""Left edge and width of the board."""
DRIVER_X, INPUT_X, BOX = 700, 20, 180
STEP_COLOUR, DIR_COLOUR, ENABLE_COLOUR, SENSE_COLOUR, GROUND = (
    "#1f5fa8",
    "#7a3fa0",
    "#b3541e",
    "#1a7f37",
    "#333",
)


def svg() -> str:
    """The whole drawing."""
    pins = engine_pins.table()
    right = [
        y for number, row in enumerate(pins["STEP"]) for y in _driver(number, row[0], pins["DIR"][number])
    ]
    enable_y = TOP + 3 * ROW * len(pins["STEP"]) + ROW
    right += _enable(pins["ENABLE"], enable_y, len(pins["STEP"]))
    left, rows = _inputs(pins)
    bottom = max(enable_y + 3 * ROW, TOP + rows * ROW)
    x, width = BOARD
    board = [
        _box(x, TOP - 30, width, bottom - TOP + 30, "STM32F407 board"),
        *_ground(bottom),
    ]
    height = bottom + 4 * ROW
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" '
        'aria-label="Which pin of the board goes to which driver, encoder and switch">',
        "<style>text { font: 13px system-ui, Roboto, Arial, sans-serif; } .pin { font-family: monospace; "
        "font-weight: 600; } .small { font-size: 11px; fill: #444; } .name { font-weight: 600; }</style>",
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
        *board,
        *right,
        *left,
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _driver(number: int, step: str, direction: str) -> list[str]:
    y = TOP + 3 * ROW * number
    return [
        _box(DRIVER_X, y - 14, BOX, 2 * ROW + 6, ""),
        _text(DRIVER_X + 66, y + 14, f"driver {number + 1}", "name"),
        _text(DRIVER_X + 66, y + 30, "and its motor", "small"),
        *_wire(step, y, STEP_COLOUR, "STEP"),
        *_wire(direction, y + ROW, DIR_COLOUR, "DIR"),
    ]


def _enable(pin: str, y: int, drivers: int) -> list[str]:
    """One pin to all drivers: a line next to them, with a branch to each."""
    x, width = BOARD
    bus = DRIVER_X + BOX + 12
    found = [
        _text(x + width - 8, y + 4, f"P{pin}", "pin", "end"),
        f'<polyline points="{x + width},{y} {bus},{y} {bus},{TOP + 12}" fill="none" stroke="{ENABLE_COLOUR}" '
        'stroke-width="2"/>',
        _text(x + width + 10, y - 5, "ENABLE, to all drivers", "small"),
        _text(x + width + 10, y + 16, "outside: a resistor to its inactive level", "small"),
    ]
    return found + [
        _line(DRIVER_X + BOX, TOP + 3 * ROW * number + 12, bus, TOP + 3 * ROW * number + 12, ENABLE_COLOUR)
        for number in range(drivers)
    ]


def _wire(pin: str, y: int, colour: str, label: str) -> list[str]:
    x, width = BOARD
    return [
        _text(x + width - 8, y + 4, f"P{pin}", "pin", "end"),
        _line(x + width, y, DRIVER_X, y, colour),
        _text(DRIVER_X + 8, y + 4, label, "small"),
    ]


def _inputs(pins: dict[str, object]) -> tuple[list[str], int]:
    """Encoders, E-stop and switches, from top to bottom; the drawing and its number of rows."""
    found: list[str] = []
    row = 0
    for number, (_, first, second, _) in enumerate(pins["ENCODER"], 1):  # type: ignore[call-overload]
        y = TOP + row * ROW
        found.append(_box(INPUT_X, y - 14, BOX, 2 * ROW + 6, f"encoder {number}"))
        for phase, pin, at in (("A", first, y), ("B", second, y + ROW)):
            found += _sensed(pin, at, phase)
        row += 3
    contacts = [("E-stop", pins["ESTOP"]), *[(f"switch {n}", pin) for n, pin in enumerate(pins["LIMIT"], 1)]]  # type: ignore[arg-type, var-annotated]
    for name, pin in contacts:
        y = TOP + row * ROW
        found += [
            _box(INPUT_X, y - 14, BOX, 28, name),
            f'<polyline points="{INPUT_X + 96},{y} {INPUT_X + 120},{y}" stroke="#000" stroke-width="2"/>',
            f'<circle cx="{INPUT_X + 96}" cy="{y}" r="3"/><circle cx="{INPUT_X + 120}" cy="{y}" r="3"/>',
            *_sensed(str(pin), y, ""),
        ]
        row += 2
    y = TOP + row * ROW - 18
    found.append(_text(INPUT_X, y, "contacts that open when they trip, to 3.3 V", "small"))
    found.append(_text(INPUT_X, y + 14, 'where active = "low", to GND where "high"', "small"))
    return found, row + 1


def _sensed(pin: str, y: int, label: str) -> list[str]:
    return [
        _text(BOARD[0] + 8, y + 4, f"P{pin}", "pin"),
        _line(INPUT_X + BOX, y, BOARD[0], y, SENSE_COLOUR),
        _text(INPUT_X + BOX - 20, y + 4, label, "small"),
    ]


def _ground(bottom: int) -> list[str]:
    y = bottom + 2 * ROW
    x = BOARD[0] + BOARD[1] // 2
    ends = (INPUT_X + BOX // 2, x, DRIVER_X + BOX // 2)
    names = ("encoders, contacts", "board (USB)", "drivers, motor supply")
    return [
        f'<line x1="{ends[0]}" y1="{y}" x2="{ends[2]}" y2="{y}" stroke="{GROUND}" stroke-width="3"/>',
        _text(x, y + 20, "GND: one for all", "name", "middle"),
        *(_text(end, y - 8, name, "small", "middle") for end, name in zip(ends, names, strict=True)),
    ]


def _box(x: int, y: int, width: int, height: int, title: str) -> str:
    box = f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="6" fill="#f4f6f8" stroke="#555"/>'
    middle = y + 19 if height > 60 else y + height // 2 + 4
    return box + (
        _text(
            x + (width // 2 if height > 60 else 8),
            middle,
            title,
            "name",
            "middle" if height > 60 else "start",
        )
        if title
        else ""
    )


def _line(x1: int, y1: int, x2: int, y2: int, colour: str) -> str:
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{colour}" stroke-width="2"/>'


def _text(x: int, y: int, text: str, kind: str, anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" class="{kind}" text-anchor="{anchor}">{escape(text)}</text>'


if __name__ == "__main__":
    TARGET.write_text(svg(), encoding="utf-8")
    print(TARGET)
