"""What the self-test's parts leave of the heap, and instructions of what they time: host/docs/measurements.md.

    python -m tests.benchmark.selftest_heap MICROPYTHON FOLDER

MICROPYTHON as for tests/benchmark/firmware.py. The firmware with the program is built in FOLDER (new), and run by QEMU;
the parts are run at its prompt and loaded up to the start of their motion; of what they time, QEMU counts the
instructions (``selftest.board_part`` has them). QEMU has no watchdog, DWT, random numbers,
backup SRAM, nor DMA for these timers, and cannot write the flash, so what goes beyond that runs on no emulator.
"""

import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

from armtempo.deploy.firmware import frozen
from armtempo.diagnosis.selftest import motion, prompt, rate_part
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo_shared import armrecord

from tests.benchmark import firmware

RECORD = "/flash/armtempo/arm.ata"
BOOT_S = 10
_SHIFT = 3
_INSTRUCTIONS_A_US = 1000 / 2**_SHIFT * 16 / 168
"""An instruction takes 2 ** _SHIFT ns of QEMU's time, in which SysTick counts 168 MHz; MicroPython takes it for the 16
MHz of a chip whose clock is not set up. SysTick's interrupts are in the counts: half a percent."""
STAND_INS = """
import sys, os, machine
from armtempo_board.hardware import backup_sram
class Beyond:
    def __init__(self, module, **own):
        self._module, self._own = module, own
    def __getattr__(self, name):
        return self._own.get(name) or getattr(self._module, name)
sys.modules["os"] = Beyond(os, urandom=bytes)
sys.modules["machine"] = Beyond(machine, unique_id=lambda: bytes(12))
backup_sram.find = lambda: 0x20020000
import stm, time
from armtempo_board.selftest import common
common.feed = lambda: None
common.cycles = time.ticks_us
common.enable = lambda: (1, 1, 1)
from armtempo_board.selftest import estop
estop.triggers = lambda engine: {"": (stm.EXTI, 0, 0, 0)}
def idle(engine, *_):
    raise OSError("{'free': %d, 'largest': %d}" % (common.free(), common.largest()))
from armtempo_board.motion.engine import Engine
Engine.start = idle
from armtempo_board.hardware.inputs import Inputs
Inputs.estop_active = lambda _: False
"""


def parts(record: bytes) -> dict[str, tuple[str, dict[str, object]]]:
    """By title: the part, and its arguments."""
    _, joints, _ = armrecord.unpack(record)
    moved, gentle = motion.back_in_turn(joints), motion.gentle(joints)
    common: dict[str, object] = {"record": RECORD, "idle_us": 0}
    starts = {"motion": moved.record.hex(), "start_steps": moved.start_steps, "rates": moved.rates}
    stops: dict[str, object] = {**starts, "motions": [starts["motion"]] * 2, "waits_us": [0]}
    del stops["motion"]
    found: dict[str, tuple[str, dict[str, object]]] = {
        "encoders": (
            "encoders",
            {**common, "motion": gentle.record.hex(), "start_steps": gentle.start_steps},
        ),
        "pulses": ("pulses", {**common, **starts, "most": 2000}),
        "stops": (
            "estop",
            {**common, **stops},
        ),
    }
    for count in (1, 3):
        rates = [round(rate_part.stated(count) / rate_part.KEPT)] * count
        tried = {"motion": motion.at_rates(rates, 0.4).hex(), "rates": [motion.limit(rate) for rate in rates]}
        tried = {**common, **tried, "frames": rate_part.frames()}
        found[f"rates, {count}"] = ("rates", tried)
        found[f"watched, {count}"] = ("rates", {**tried, "watch": ("A", 0)})
    return {**found, "cycles": ("cycles", {"motion": motion.evaluated().hex()})}


def main(micropython: Path, folder: Path) -> None:
    """Print the figures."""
    frozen.write(folder / "program")
    elf = firmware.build(micropython, folder, folder / "program" / frozen.MANIFEST)
    record = encode.arm_record(Arm.paper())
    tree = folder / "tree"
    (tree / "armtempo").mkdir(parents=True, exist_ok=True)
    (tree / "armtempo" / "arm.ata").write_bytes(record)
    (tree / "boot.py").write_text("import pyb\npyb.usb_mode(None)\n")
    (tree / "main.py").write_text("")
    cut = folder / "cut"
    cut.write_bytes(struct.pack("<i", 0))
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = firmware.emulator(elf, firmware.make_image(tree), cut)
    command += ["-icount", f"shift={_SHIFT}"]
    command[command.index("stdio")] = f"tcp:127.0.0.1:{port},server=on,wait=on,nodelay=on"
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            time.sleep(1)
            with prompt.at_prompt(f"socket://127.0.0.1:{port}") as there:
                there.at_end = "pass"
                time.sleep(BOOT_S)
                for title, (part, arguments) in parts(record).items():
                    there.enter(soft_reset=title != "encoders")
                    print(f"{title:<10}", _said(there, part, arguments))
        finally:
            process.kill()


def _said(there: prompt.Prompt, part: str, arguments: dict[str, object]) -> str:
    call = f"import json\nfrom armtempo_board.selftest import {part} as part\n"
    call += f"print(json.dumps(part.measure(**{arguments!r})))\n"
    try:
        took = there._run(part, STAND_INS + call).values
        return (
            str({what: round(_INSTRUCTIONS_A_US * took_us, 1) for what, took_us in took.items()})
            + " instructions"
        )
    except prompt.PartError as error:
        return error.problem.partition("OSError: ")[2] or error.problem


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve())
