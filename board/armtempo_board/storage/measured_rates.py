"""The step rates that a self-test measured, in flash. They count for this chip, firmware and program only.

In a program in files they are never read: the self-test needs the firmware.
"""

from binascii import crc32
from struct import calcsize, pack, unpack

from micropython import const

from armtempo_board import step_rates

_FILE = "/rates.bin"
_FIELDS = "<IIB"  # of one joint, of all together, of how many joints they were measured
_CRC_BYTES = const(4)  # crc32 over the fields, which begins with the hash of what they count for


def read(root: str, board_id: bytes, program_crc: int) -> None:
    """Take what is stored, if it is of this chip with its firmware (``board_id``) and this program."""
    try:
        with open(root + _FILE, "rb") as file:
            data = file.read(calcsize(_FIELDS) + _CRC_BYTES + 1)
    except OSError:
        return
    if len(data) == calcsize(_FIELDS) + _CRC_BYTES and data == _sealed(
        data[:-_CRC_BYTES], board_id, program_crc
    ):
        step_rates.one, step_rates.together, step_rates.joints = unpack(_FIELDS, data[:-_CRC_BYTES])


def write(root: str, board_id: bytes, program_crc: int, rates: "tuple[int, int, int]") -> None:
    """Store them; they are in force after the next start."""
    with open(root + _FILE, "wb") as file:
        file.write(_sealed(pack(_FIELDS, *rates), board_id, program_crc))


def _sealed(fields: bytes, board_id: bytes, program_crc: int) -> bytes:
    return bytes(fields + crc32(fields, crc32(board_id, program_crc)).to_bytes(_CRC_BYTES, "little"))
