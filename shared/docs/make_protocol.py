"""Writes the tables of protocol.md from the message table: ``python shared/docs/make_protocol.py``."""

import sys
from pathlib import Path

PAGE = Path(__file__).with_name("protocol.md")
sys.path.insert(0, str(PAGE.parent.parent))

from armtempo_shared import engine_memory, limits, meanings, messages, sequence  # noqa: E402
from armtempo_shared.table import rows  # noqa: E402


def page(text: str) -> str:
    """The page with its generated parts brought up to date."""
    parts = {
        "figures": _figures(),
        "commands": _commands(),
        "events": _events(),
        "errors": _errors(),
    }
    for name, body in parts.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, rest = text.split(begin)
        text = before + begin + body + end + rest.split(end)[1]
    return text


def _table(*lines: tuple[str, ...]) -> str:
    """A Markdown table; the first line is its head."""
    rule = "|" + " --- |" * len(lines[0])
    head, *body = ["| " + " | ".join(line) + " |" for line in lines]
    return "\n".join([head, rule, *body]) + "\n"


def _fields(row: tuple[str, int, str, list[str], str]) -> str:
    pairs = [f"{name} {kind}" for name, kind in zip(row[3], row[2][1:], strict=True)]
    return ", ".join(pairs + [f"*{row[4]}*"] * bool(row[4])) or "–"


def _figures() -> str:
    return _table(
        ("figure", "value"),
        ("protocol version", str(messages.PROTOCOL_VERSION)),
        ("first byte of a frame", f"0x{messages.SYNC:02X}"),
        (
            "largest payload of a command; of the others",
            f"{messages.MAX_COMMAND}; {messages.MAX_PAYLOAD} bytes",
        ),
        ("largest record that is run once from memory", f"{engine_memory.ONCE_BYTES} bytes"),
        ("largest record", f"{limits.MAX_MOTION_BYTES} bytes"),
        ("longest name", f"{limits.MAX_NAME} characters of a-z A-Z 0-9 - _"),
        ("joints; encoders", f"{limits.MAX_JOINTS}; {limits.MAX_ENCODERS}"),
        ("outputs; inputs of an arm", f"{limits.MAX_OUTPUTS}; {limits.MAX_INPUTS}"),
        ("time segments of a motion", str(limits.MAX_SEGMENTS)),
        ("highest rate of one joint", f"{limits.MAX_STEP_RATE} steps/s"),
        ("rows; motions of a sequence", f"{sequence.MAX_ROWS}; {sequence.MAX_MOTIONS}"),
        ("repeats within each other; counters", f"{sequence.MAX_NESTING}; {sequence.MAX_COUNTERS}"),
        ("longest wait in a sequence", f"{sequence.MAX_WAIT_MS} ms"),
        ("a held motion brakes after a silence of", f"{limits.HOLD_TIMEOUT_MS} ms"),
        ("rates of a motion's time", f"{messages.SLOWEST_PERMILLE} to {messages.PERMILLE} thousandths"),
        ("states, from 0", ", ".join(messages.STATES)),
    )


def _commands() -> str:
    answers = {row[0]: row for row in [*rows("A"), *rows("P"), *rows("T")]}
    lines = [
        (f"`{row[0]}`", f"0x{row[1]:02X}", _fields(row), _fields(answers[row[0]]), meanings.COMMANDS[row[0]])
        for row in [*rows("C"), *rows("O"), *rows("S")]
    ]
    return _table(("command", "id", "fields", "answer", "meaning"), *lines)


def _events() -> str:
    lines = [
        (f"`{row[0]}`", f"0x{row[1]:02X}", _fields(row), meanings.EVENTS[row[0]])
        for row in [*rows("E"), *rows("R")]
    ]
    return _table(("message", "id", "fields", "meaning"), *lines)


def _errors() -> str:
    lines = [
        (str(code), f"`{name}`", what, meanings.VALUES.get(name, "–"), cure)
        for code, (name, what, cure) in sorted(meanings.ERRORS.items())
    ]
    return _table(("code", "name", "meaning", "`value`", "cure"), *lines)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text()))
