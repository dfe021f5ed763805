"""The message table: every command, answer, event and reply with its number and fields.

``wire.py`` encodes and decodes with it, ``shared/docs/protocol.md`` is generated from it. It is a single text, so that
the board can parse it and free the memory.

A row has

- the kind: C command, A its answer; O and P the same of commands that a board only knows if its arm has outputs or
  inputs; S and T of those that it knows once a sequence was started; E event; R reply;
- the name, and the number in hex;
- fields as ``name:type`` with the letters of ``struct``, little endian without padding;
- ``text`` (UTF-8) or ``bytes`` if the rest of the payload is such a tail.

A line that begins with a blank continues the row.
"""

from struct import calcsize

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    Row = tuple[str, int, str, list[str], str]

_TABLE = """\
C hello 01 protocol:B session:I
C status 02
C put_begin 10 size:I crc:I text
C put_data 11 offset:I bytes
C put_commit 12 crc:I
C list 13 index:H
C remove 14 text
C rename 15 old_length:B text
C get 16 offset:I length:H text
C set_default 17 text
C put_once 1a offset:H size:H bytes
C home 20 joints:B bytes
C start 21 flags:H crc:I text
C stop 22 now:B
C clear 23
C speed 25 rate:H
C leave 24
S sequence 18
S counter 19 index:B
O output 26 number:B value:H
O inputs 27
C hold 28
C drivers 29 on:B
C samples 30 acknowledged:I wanted:H
A hello 01 protocol:B joints:B encoders:B state:B tick_hz:I max_rate:I max_rate_sum:I free_flash:I
 free_heap:I arm_crc:I program_crc:I boot:I engine_bytes:I features:B
 arm_problem:B arm_value:I once_bytes:H text
A status 02 state:B fault:B fault_joint:B known:B run:I ticks:Q path:Q rate:H
 samples_kept:H samples_lost:I frames_bad:I rest_ms:H bytes
A put_begin 10
A put_data 11 next:I
A put_commit 12
A list 13 count:H size:I crc:I duration:Q joints:B default:B sequence:B text
A remove 14
A rename 15
A get 16 size:I bytes
A set_default 17
A put_once 1a next:H
A home 20
A start 21 run:I duration:Q
A stop 22
A clear 23
A speed 25
A leave 24
T sequence 18 ending:B code:B step:H row:H cycle:I text
T counter 19 count:B value:I text
P output 26
P inputs 27 levels:B bytes
A hold 28
A drivers 29
A samples 30 first:I count:H
E sample 40 run:I index:I ticks:Q path:Q flags:B bytes
E done 41 run:I ticks:Q path:Q samples:I lost:I bytes
E fault 42 run:I code:B joint:B ticks:Q path:Q bytes
E notice 43 text
E row 44 passed:I run:I row:H step:H cycle:I value:I
R ok 7e command:B bytes
R error 7f command:B code:B joint:B value:q
"""


def rows(kind: str) -> "Iterator[Row]":
    """(name, number, struct format, field names, tail) of each row of a kind, in order."""
    for line in _TABLE.replace("\n ", " ").split("\n"):
        if line[:1] == kind:
            yield _parsed(line)


def row_of(kind: str, number: int) -> "Row":
    """The row of a number; raises KeyError if there is none.

    It looks at no other row: on the board, which collects its heap after every 2 KB, that would take 0.14 s.
    """
    text = " %02x" % number
    at = _TABLE.find(text)
    while at >= 0:
        begin = _TABLE.rfind("\n", 0, at) + 1
        if _TABLE[begin : begin + 1] == kind and _TABLE[at + 3] in " \n":  # not a field such as 'fault'
            end = _TABLE.find("\n", at)
            while _TABLE[end + 1 : end + 2] == " ":
                end = _TABLE.find("\n", end + 1)
            return _parsed(_TABLE[begin:end])
        at = _TABLE.find(text, at + 1)
    raise KeyError(number)


def _parsed(line: str) -> "Row":
    words = line.split()
    tail = words.pop() if words[-1] in ("text", "bytes") else ""
    fields = [word.split(":") for word in words[3:]]
    layout = "<" + "".join([field[1] for field in fields])
    return words[1], int(words[2], 16), layout, [field[0] for field in fields], tail


def offset(kind: str, name: str, field: str) -> int:
    """Offset of a field in the payload of a message; raises KeyError if there is none."""
    for found, _, layout, fields, _ in rows(kind):
        if found == name and field in fields:
            return calcsize(layout[: 1 + fields.index(field)])
    raise KeyError(field)
