"""What stands for compilers, flash tools and a checkout of MicroPython."""

from __future__ import annotations

import shutil
from pathlib import Path

from armtempo.cli import main
from click.testing import CliRunner

MAKE = """#!/bin/sh
echo "$@" >> "$MAKE_LOG"
for word in "$@"; do case "$word" in BUILD=*) out="${word#BUILD=}";; esac; done
[ -n "$MAKE_FAILS" ] && { echo "error: it does not compile"; exit 2; }
[ -n "$out" ] || exit 0
for name in firmware0.bin firmware1.bin firmware.dfu firmware.hex firmware.elf; do echo "$name" > "$out/$name"; done
"""
GCC = '#!/bin/sh\ncase "$1" in -dump*) echo 13.2.1;; *) exit ${NO_NEWLIB:-0};; esac\n'
TOOL = '#!/bin/sh\necho "${0##*/} $@" >> "$TOOL_LOG"\n'
CP = shutil.which("cp")
DFU = (
    TOOL
    + f"""case "$1" in --list) printf "$DFU_LIST"; echo "$DFU_SAYS" >&2; exit;; esac
printf 'Erase\t[   ] 100%%  0 bytes\rDownload\t[   ]  50%%  5 bytes\r'
at=${{6%%:*}}
case "$7" in
-D) {CP} "$8" "$TOOL_LOG.$at";;
-U) if [ -n "$DFU_DAMAGES" ]; then echo other > "$8"; else {CP} "$TOOL_LOG.$at" "$8"; fi;;
esac
case "$6" in *leave) $DFU_STARTS;; esac
exit ${{DFU_FAILS:-0}}
"""
)
STLINK = (
    TOOL
    + f"""case "$2" in
write) {CP} "$3" "$TOOL_LOG.$4";;
read) {CP} "$TOOL_LOG.$4" "$3";;
esac
"""
)
ST_INFO = """#!/bin/sh
echo 'Found 1 stlink programmers
  version:    V2J37S26
  flash:      1048576 (pagesize: 16384)
  sram:       196608
  '"${ST_CHIP-chipid:     0x413}"
"""


def dfu_list(sectors: str) -> str:
    """What dfu-util lists of one chip in its bootloader, whose flash has these sectors."""
    device = 'Found DFU: [0483:df11] ver=2200, devnum=9, cfg=1, intf=0, path="1-1"'
    return (
        f'{device}, alt=1, name="@Option Bytes  /0x1FFFC000/01*016 e", serial="3"\\n'
        f'{device}, alt=0, name="@Internal Flash  /0x08000000/{sectors}", serial="3"\\n'
    )


ONE = dfu_list("04*016Kg,01*064Kg,07*128Kg")
BOARD_MAKE = """CMSIS_MCU = STM32F407xx
ifeq ($(USE_MBOOT),1)
TEXT0_ADDR = 0x08020000
else
TEXT0_ADDR = 0x08000000
TEXT1_ADDR = 0x08020000
endif
"""
HEADER = '#define MICROPY_HW_BOARD_NAME "F4DISC"\n#define MICROPY_HW_MCU_NAME "STM32F407"\n'
STM32F4DISC = "ports/stm32/boards/STM32F4DISC"
HEAD = str(shutil.which("head"))
MACHINE = "F4DISC with STM32F407"


def no_progress(done: float, whole: float) -> None: ...


def outcome(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and what is said of a command."""
    done = CliRunner().invoke(main, [str(each) for each in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.output
