"""The start-up sequence, replayed: every register it leaves, against the reference manual's bit fields."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests import interpreters
from tests.benchmark import firmware

SCRIPT = Path(__file__).parent / "scripts" / "probes" / "register_image.py"

# RM0090: TIMx_CCMRx OCxM forced inactive (18.4.7), TIMx_CCER CCxE (18.4.9), DMA_SxCR fields (10.5.5)
_LOW_1, _LOW_2 = 0b100 << 4, 0b100 << 12
_ON = {1: 1 << 0, 2: 1 << 4, 3: 1 << 8, 4: 1 << 12}
_WORDS, _UP, _CIRCULAR, _TO_PERIPHERAL, _URGENT = 2 << 13 | 2 << 11, 1 << 10, 1 << 8, 1 << 6, 3 << 16
_STREAM = _WORDS | _UP | _CIRCULAR | _TO_PERIPHERAL | _URGENT

EXPECTED = {
    "RCC+30": 1 << 21,  # AHB1ENR: DMA1
    "RCC+40": 0b11111,  # APB1ENR: TIM2 to TIM6
    "RCC+44": 0b11,  # APB2ENR: TIM1, TIM8
    "TIM2+04": 0b001 << 4,  # CR2.MMS: enable
    "TIM2+08": 1 << 7,  # SMCR.MSM
    "TIM2+18": _LOW_1 | _LOW_2,
    "TIM2+1c": _LOW_1,
    "TIM2+20": _ON[1] | _ON[2] | _ON[3],
    "TIM2+2c": 0xFFFFFFFF,  # ARR
    "TIM5+08": 0b110,  # SMCR: TS ITR0 (TIM2), SMS trigger
    "TIM5+18": _LOW_1 | _LOW_2,
    "TIM5+1c": _LOW_1 | _LOW_2,
    "TIM5+20": _ON[1] | _ON[3] | _ON[4],
    "TIM5+2c": 0xFFFFFFFF,
    "TIM6+0c": 1,  # DIER.UIE
    "TIM6+2c": 41_999,  # ARR: 0.5 ms
}
EXPECTED |= {
    "NVIC_IPR+14": 12 << 28,  # IRQ 23, EXTI9_5: above the timers' 13
    "NVIC_IPR+28": 12 << 4,  # IRQ 40, EXTI15_10
    "NVIC_IPR+34": 14 << 20,  # IRQ 54, TIM6: below them
}
for _timer in (1, 3, 4, 8):  # encoders
    EXPECTED |= {
        f"TIM{_timer}+00": 1,  # CR1.CEN
        f"TIM{_timer}+08": 0b011,  # SMCR.SMS: encoder mode 3
        f"TIM{_timer}+10": 1,  # SR.UIF: of the update event that took the period over
        f"TIM{_timer}+18": 0b0011 << 4 | 0b01 | 0b0011 << 12 | 0b01 << 8,  # IC1F, CC1S, IC2F, CC2S
        f"TIM{_timer}+2c": 0xFFFF,
    }
# stream: request channel, compare register as seen from TIM2 (TIM5 lies 0xC00 after it)
_STREAMS = {5: (3, 0x34), 6: (3, 0x38), 1: (3, 0x3C), 2: (6, 0xC34), 0: (6, 0xC3C), 3: (6, 0xC40)}
for _stream, (_request, _compare) in _STREAMS.items():
    _at = 0x10 + 0x18 * _stream
    EXPECTED[f"DMA1+{_at:02x}"] = _request << 25 | _STREAM
    EXPECTED[f"DMA1+{_at + 4:02x}"] = 1024  # NDTR
    EXPECTED[f"DMA1+{_at + 8:02x}"] = _compare
    EXPECTED[f"DMA1+{_at + 12:02x}"] = 1  # a ring


_SECTION = re.compile(r"\d+\.\d+\.\d+")
_PAGE = re.compile(r"(\d+|\?)(?: or \d+)?")  # "583 or 584" is one page that is not known exactly


def _image(interpreter: str) -> dict[str, int]:
    lines = interpreters.run(interpreter, SCRIPT, heap="6M").splitlines()
    return {name: int(value, 16) for name, value in (line.split() for line in lines)}


def _field(image: dict[str, int], register: str, pin: int, bits: int) -> int:
    return image.get(register, 0) >> pin * bits & (1 << bits) - 1


def test_timers_and_streams(interpreter: str) -> None:
    image = {name: value for name, value in _image(interpreter).items() if not name.startswith("GPIO")}
    image.pop("TIM6+24", 0)  # its count when it was stopped
    assert image == EXPECTED


def test_pins() -> None:
    """Modes (8.4.1), pulls (8.4.4), alternate functions (8.4.9, data sheet table 9) of every pin in use."""
    image = _image("cpython")
    alternate = {
        "A15": 1, "A1": 1, "B10": 1, "A2": 2, "A3": 2, "A0": 2,
        "E9": 1, "E11": 1, "B4": 2, "B5": 2, "C6": 3, "C7": 3, "B6": 2, "B7": 2,
        "A13": 0, "A14": 0, "B3": 0,  # the debugger's, as after a reset
    }  # fmt: skip
    outputs = {"E7", "E8", "E10", "E13", "E14", "E6", "E12"}
    pulls = {"E9": 1, "E11": 1, "B4": 1, "B5": 1, "C6": 1, "C7": 1, "B6": 1, "B7": 1, "D8": 2, "D10": 2}
    pulls |= {"A13": 1, "A14": 2}
    for port in "ABCDE":
        for number in range(16):
            pin = f"{port}{number}"
            mode = 2 if pin in alternate else 1 if pin in outputs else 0
            assert _field(image, f"GPIO{port}+00", number, 2) == mode, pin
            assert _field(image, f"GPIO{port}+0c", number, 2) == pulls.get(pin, 0), pin
            if mode == 2:
                register = f"GPIO{port}+{0x20 + 4 * (number >> 3):02x}"
                assert _field(image, register, number & 7, 4) == alternate[pin], pin
    assert image["GPIOE+14"] == 1 << 12, "ENABLE is inactive, DIR low"


def _documented() -> list[tuple[str, str]]:
    """(sections, pages) of each row of the documented register table."""
    text = (interpreters.ROOT / "board" / "docs" / "hardware.md").read_text()
    table = text.split("\n## Registers\n")[1].split("\n## ")[0]
    rows = [line.split("|") for line in table.splitlines() if line.startswith("| ")]
    return [(row[2], row[3]) for row in rows[1:]]


def test_sections_in_the_documentation() -> None:
    """The documented register table has the rows that the board applies."""
    source = (interpreters.ROOT / "board" / "armtempo_board" / "hardware" / "registers.py").read_text()
    notes = re.findall(r"\),  # ([^:]*):", source)  # "18.4.1 (17.4.1)" after each row
    applied = {name for note in notes for name in _SECTION.findall(note)}
    documented = {name for sections, _ in _documented() for name in _SECTION.findall(sections)}
    assert applied
    assert applied <= documented


def test_pages_in_the_documentation() -> None:
    """Every section has one page, the same in all rows; in the order of the sections, pages never decrease."""
    found: dict[tuple[int, ...], int] = {}
    for sections, pages in _documented():
        names, numbers = _SECTION.findall(sections), _PAGE.findall(pages)
        assert names
        assert len(names) == len(numbers), sections
        if "PM0214" in sections:
            continue  # another manual
        for name, number in zip(names, numbers, strict=True):
            if number == "?":
                continue
            key = tuple(int(part) for part in name.split("."))
            assert found.setdefault(key, int(number)) == int(number), name
    ordered = [found[key] for key in sorted(found)]
    assert ordered == sorted(ordered)


def test_emulated_and_virtual_board_have_the_memory_of_the_chip() -> None:
    """As MicroPython's own board files say it; before each build of an emulated board they are read again."""
    memory = firmware.CHIP["memory"]
    assert (firmware.FLASH_AT, firmware.FLASH_BLOCKS) == (0x08004000, 224)
    hardware = interpreters.ROOT / "host" / "armtempo" / "simulator" / "hardware"
    modules = ("chip/flash.py", "chip/fat.py", "firmware/boot.py")
    virtual = {name: value for path in modules for name, value in _assigned(hardware / path).items()}
    root_folder, boot_and_table = 32, 2  # FAT12
    assert virtual["BLOCKS"] == firmware.FLASH_BLOCKS - root_folder - boot_and_table
    assert (virtual["BLOCK"], virtual["_FACTORY_FILES"]) == (firmware.CHIP["block"], firmware.FACTORY_FILES)
    begin, size = memory["RAM"]
    for path in (*firmware.SCRIPTS.glob("firmware_*.py"), Path(firmware.__file__).with_name("loop_board.c")):
        places = [int(found, 16) for found in re.findall(r"0x200[0-9A-F]{5}", path.read_text())]
        assert all(place >= begin + 1024 * size for place in places), f"{path.name} is in the chip's memory"


def _assigned(path: Path) -> dict[str, object]:
    """Literals that a module gives names."""
    pairs = [
        (node.targets[0], node.value)
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.Assign)
    ]
    return {
        ast.unparse(name): ast.literal_eval(value)
        for name, value in pairs
        if isinstance(value, ast.Constant | ast.Dict)
    }
