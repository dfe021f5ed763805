"""The step rates measured by a self-test, in flash; valid for this chip, firmware and program only.

Not used by the program in files, as the self-test needs the firmware.
"""

from binascii import crc32
from struct import calcsize, pack, unpack

from micropython import const

from armtempo_board import step_rates

_FILE = "/rates.bin"
_FIELDS = "<IIB"  # of one joint, of all together, number of joints in the measurement
_CRC_BYTES = const(4)  # crc32 of the fields, initialised with the hash of chip, firmware and program


def read(root: str, board_id: bytes, program_crc: int) -> None:
    """Use the stored rates, if they are of this chip with its firmware (``board_id``) and this program."""
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
    """Store them; they are used from the next start on."""
    with open(root + _FILE, "wb") as file:
        file.write(_sealed(pack(_FIELDS, *rates), board_id, program_crc))


def _sealed(fields: bytes, board_id: bytes, program_crc: int) -> bytes:
    return bytes(fields + crc32(fields, crc32(board_id, program_crc)).to_bytes(_CRC_BYTES, "little"))
