"""The simulated memory, case by case: flash, what is left of it if the power fails, registers, backup SRAM.

Argument: a scratch folder.
"""

import sys

import bare_board  # replaces time, os, uctypes, micropython; so before everything else
import cases
from chip import memory
from machine_state import Reset

# isort: split
import os
import time

import machine
import micropython
import pyb
import stm
import uctypes
from machine import mem32

SCRATCH = sys.argv[1]


def case_flash_is_as_big_as_the_chips():
    os.mkdir("data")
    free = os.statvfs("/flash")[3]
    assert free == 189  # of 190, as a folder takes one
    with open("/flash/data/small", "wb") as small:
        small.write(bytes(100))
        with open("/flash/data/big", "wb") as file:
            try:
                for _ in range(400):
                    file.write(bytes(512))
                raise AssertionError("flash has no end")
            except OSError as error:
                assert error.args[0] == 28
        assert os.statvfs("/flash")[3] == 0
        small.write(bytes(412))  # its block has space
        try:
            small.write(b"x")
            raise AssertionError("another block")
        except OSError as error:
            assert error.args[0] == 28
    os.remove("data/big")
    for number in range(13):  # with "small" and the folder's own two: 16 entries fill a block
        open("/flash/data/%d.atm" % number, "wb").close()
    assert os.statvfs("/flash")[3] == free - 1
    open("/flash/data/long.atm.new", "wb").close()
    assert os.statvfs("/flash")[3] == free - 2
    for name in os.listdir("data"):
        if name != "small":
            os.remove("data/" + name)
    os.remove("data/small")
    assert os.statvfs("/flash")[3] == free
    assert os.listdir("/flash") == ["data"] and os.listdir("/") == ["flash"]
    assert [entry[0] for entry in os.ilistdir()] == ["data"]
    os.rmdir("data")
    try:
        os.stat("/elsewhere")
        raise AssertionError("outside the flash")
    except OSError as error:
        assert error.args[0] == 2


def write_aside(name, data, synced=True):
    """Write a file and rename it into its place."""
    with open(name + ".new", "wb") as file:
        file.write(data)
    if synced:
        os.sync()
    os.rename(name + ".new", name)


def case_power_cuts():
    operations = 5  # open, write, close, removal of the old one, rename
    states = []
    for cut in range(1, operations + 2):
        bare_board.start(flash=SCRATCH)
        for name in list(os.listdir()):
            if name.startswith("file"):
                os.remove(name)
        write_aside("file", b"old")
        bare_board.start(flash=SCRATCH, power_cut_at=cut)
        try:
            write_aside("file", b"newer")
            whole = True
        except Reset as reset:
            assert reset.cause == machine.PWRON_RESET
            whole = False
        assert whole == (cut > operations)
        state = {}
        for name in os.listdir():
            if name.startswith("file"):
                with open(name, "rb") as file:
                    state[name] = file.read()
        states.append(sorted(state.items()))
    aside = [("file", b"old"), ("file.new", b"")]
    wanted = [[("file", b"old")], aside, aside, [("file", b"old"), ("file.new", b"newer")],
              [("file.new", b"newer")], [("file", b"newer")]]  # fmt: skip
    assert states == wanted, states


def case_what_is_not_synced_is_lost_with_the_power():
    """Whatever its name is by then; what was synced lasts, and so does what others had before."""
    for synced in (True, False):
        bare_board.start(flash=SCRATCH)
        write_aside("file", b"old")
        bare_board.start(flash=SCRATCH, power_cut_at=6)
        write_aside("file", b"newer", synced)
        try:
            os.mkdir("folder")  # here the power fails
            raise AssertionError("no power cut")
        except Reset:
            pass
        with open("file", "rb") as file:
            assert file.read() == (b"newer" if synced else b""), synced
        os.remove("file")


@micropython.viper
def put(block: ptr32, word: int, value: int):
    """Write a register as board code does."""
    block[word] = value


def case_the_backup_sram_has_4_kb():
    bare_board.start()
    mem32[stm.RCC + stm.RCC_AHB1ENR] |= 1 << 18
    assert mem32[0x40024000 + 4092]
    try:
        assert mem32[0x40024000 + 4096] is None
    except ValueError:
        return
    raise AssertionError("there is more")


def case_peripherals_of_a_bus_are_1_kb_apart():
    """RM0090 table 1."""
    for first, names in (
        (0x40000000, "TIM2 TIM3 TIM4 TIM5 TIM6 TIM7 TIM12 TIM13 TIM14"),
        (0x40010000, "TIM1 TIM8"),
        (0x40013800, "SYSCFG EXTI"),
        (0x40014000, "TIM9 TIM10 TIM11"),
        (0x40020000, "GPIOA GPIOB GPIOC GPIOD GPIOE"),
        (0x40023800, "RCC FLASH"),
        (0x40026000, "DMA1 DMA2"),
    ):
        for number, name in enumerate(names.split()):
            assert memory.word_at(first + 0x400 * number) == memory.index(name), name


def case_kinds_of_memory_have_micropythons_numbers():
    """extmod/moductypes.c, of version 1.28: also if CPython has a stand-in."""
    assert (uctypes.ARRAY, uctypes.INT32) == (-1 << 30, 5 << 27)


def case_registers_by_the_chips_addresses():
    bare_board.start()
    mem32[0x40000000 + 0x2C] = -1
    assert mem32[stm.TIM2 + stm.TIM_ARR] == -1
    assert machine.mem8[stm.TIM2 + stm.TIM_ARR] == machine.mem8[stm.TIM2 + stm.TIM_ARR + 3] == 0xFF
    assert machine.mem16[stm.TIM2 + stm.TIM_ARR] == 0xFFFF
    machine.mem8[stm.TIM2 + stm.TIM_CCR1 + 1] = 0xAB
    machine.mem16[stm.TIM2 + stm.TIM_CCR1 + 2] = 0x1234
    assert mem32[stm.TIM2 + stm.TIM_CCR1] == 0x1234AB00
    assert machine.freq() == (168_000_000, 168_000_000, 42_000_000, 84_000_000)
    try:
        mem32[0x50000000] = 1
        raise AssertionError("no such register")
    except ValueError:
        pass


def case_backup_sram_needs_its_clock_and_write_access():
    """RM0090 5.1.2: a clock for the power interface, DBP, a clock of its own."""
    rcc, power, memory = stm.RCC, stm.PWR, stm.BKPSRAM
    last = memory + 4092
    mem32[last] = 5
    assert mem32[last] == 0, "without a clock it reads as 0"
    mem32[rcc + stm.RCC_AHB1ENR] |= 1 << 18
    before = mem32[last]
    mem32[last] = before ^ 5
    assert before and mem32[last] == before, "without write access it keeps what it had"
    mem32[power + stm.PWR_CR] |= 1 << 8
    mem32[last] = before ^ 5
    assert mem32[last] == before, "without a clock the power interface takes nothing"
    mem32[rcc + stm.RCC_APB1ENR] |= 1 << 28
    mem32[power + stm.PWR_CR] |= 1 << 8
    mem32[last] = -5
    put(memory, 0, 7)
    assert mem32[last] == mem32[0x40024000 + 4092] == -5 and mem32[memory] == 7
    mem32[rcc + stm.RCC_AHB1ENR] &= ~(1 << 18)
    assert mem32[last] == 0
    mem32[rcc + stm.RCC_AHB1ENR] |= 1 << 18
    assert mem32[last] == -5 and mem32[memory] == 7, "its content waits for the clock"
    mem32[power + stm.PWR_CR] &= ~(1 << 8)
    put(memory, 0, 8)
    time.sleep_us(1)
    assert mem32[memory] == 7
    words = uctypes.struct(last, (uctypes.ARRAY, 1 | uctypes.INT32))
    assert words[0] == -5 and uctypes.addressof(words) == last


def case_each_timer_is_clocked_by_its_bit():
    """RM0090 6.3.13 and 6.3.14."""
    bare_board.start()
    for enable, first_bit, numbers in (
        (stm.RCC_APB1ENR, 0, (2, 3, 4, 5, 6, 7, 12, 13, 14)),
        (stm.RCC_APB2ENR, 0, (1, 8)),
        (stm.RCC_APB2ENR, 16, (9, 10, 11)),
    ):
        for place, number in enumerate(numbers):
            before = mem32[stm.RCC + enable]
            pyb.Timer(number, prescaler=0, period=0xFFFF)
            assert mem32[stm.RCC + enable] ^ before == 1 << first_bit + place, number


def case_the_last_sectors_are_erased_and_written_as_the_manual_says():
    """RM0090 3.5 to 3.9: keys, an erased bit can only be cleared, other sectors are not touched."""
    bare_board.start()
    begin, key, control, status = 0x080C0000, stm.FLASH + 4, stm.FLASH + 0x10, stm.FLASH + 0x0C
    mem32[begin] = 0
    mem32[control] = 0x201
    mem32[begin] = 0
    assert mem32[control] == -1 << 31 and mem32[begin] == -1, "locked"
    mem32[key] = 0x45670123
    mem32[key] = 0xCDEF89AB
    mem32[begin] = 0
    assert mem32[status] & 0xF2 and mem32[begin] == -1, "without PG"
    mem32[control] = 0x201
    mem32[begin] = 0x12345678
    mem32[begin] = 0x0F0F0F0F
    mem32[begin + 0x20000] = 7
    assert mem32[begin] == 0x12345678 & 0x0F0F0F0F
    assert bytes(uctypes.bytearray_at(begin, 4)) == b"\x08\x06\x04\x02"
    mem32[control] = 0x202 | 10 << 3
    mem32[control] = 0x202 | 10 << 3 | 1 << 16
    assert (mem32[begin], mem32[begin + 0x20000]) == (-1, 7)
    mem32[control] = 0x202 | 11 << 3 | 1 << 16
    assert mem32[begin + 0x20000] == -1
    try:
        mem32[control] = 0x202 | 5 << 3 | 1 << 16
        raise AssertionError("MicroPython's own")
    except ValueError:
        pass
    assert machine.mem16[0x1FFF7A22] == 1024


for name in cases.wanted(globals()):
    bare_board.start(flash=SCRATCH + "/flash")
    globals()[name]()
    print(name)
