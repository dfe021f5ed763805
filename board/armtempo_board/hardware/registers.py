"""The start-up of the hardware as one table: which register gets which bits, and where the manual says so.

``docs/hardware.md`` explains the choices. Sections are those of the reference manual RM0090. A test replays
the table and compares the resulting register image.
"""

import stm
from machine import mem32

from armtempo_board.hardware.isr import (
    ARR,
    CCER,
    CCMR1,
    CCR1,
    CR1,
    CR2,
    DIER,
    EGR,
    PSC,
    SMCR,
    SR,
    STREAM_CR,
    STREAM_FCR,
    STREAM_M0AR,
    STREAM_PAR,
)  # fmt: skip

ALL = 0xFFFFFFFF
_AHB1ENR, _APB1ENR, _APB2ENR = 12, 16, 17  # RCC, in words

CLOCKS = (
    # block, register (word), bits cleared, bits set; section of RM0090: what it does
    ("RCC", _AHB1ENR, 0, 1 << 21),  # 7.3.10: DMA1 clock
    ("RCC", _APB1ENR, 0, 1 << 0 | 1 << 3),  # 7.3.13: TIM2 and TIM5 clocks
)
BACKUP_SRAM = (  # in the order of 5.1.2
    ("RCC", _APB1ENR, 0, 1 << 28),  # 7.3.13: power interface clock
    ("PWR", 0, 0, 1 << 8),  # 5.4.1: DBP: it may be written
    ("RCC", _AHB1ENR, 0, 1 << 18),  # 7.3.10: its clock
)
TIMERS = (
    ("TIM2", CR1, ALL, 0),  # 18.4.1: stopped, counting up
    ("TIM5", CR1, ALL, 0),  # 18.4.1: stopped, counting up
    ("TIM2", DIER, ALL, 0),  # 18.4.4: no interrupts, no DMA requests yet
    ("TIM5", DIER, ALL, 0),  # 18.4.4: no interrupts, no DMA requests yet
    ("TIM2", CR2, ALL, 1 << 4),  # 18.4.2: MMS 001: its enable bit is the trigger; CCDS 0
    ("TIM5", CR2, ALL, 0),  # 18.4.2: CCDS 0: DMA requests come from compare matches
    ("TIM2", SMCR, ALL, 1 << 7),  # 18.4.3: MSM: wait for the slave; no trigger of its own
    ("TIM2", PSC, ALL, 0),  # 18.4.11: every tick of 84 MHz
    ("TIM5", PSC, ALL, 0),  # 18.4.11: every tick of 84 MHz
    ("TIM2", ARR, ALL, ALL),  # 18.4.12: all 32 bits
    ("TIM5", ARR, ALL, ALL),  # 18.4.12: all 32 bits
    ("TIM2", EGR, 0, 1),  # 18.4.6: UG: take prescaler and period over
    ("TIM5", EGR, 0, 1),  # 18.4.6: UG: take prescaler and period over
    ("TIM5", SMCR, ALL, 6),  # 18.4.3: TS 000: ITR0 is TIM2; SMS 110: trigger mode
    ("TIM2", CCMR1, ALL, 4 << 12 | 4 << 4),  # 18.4.7: channels 1, 2 forced low; no preload
    ("TIM2", CCMR1 + 1, ALL, 4 << 4),  # 18.4.8: channel 3 forced low; channel 4 timing only
    ("TIM5", CCMR1, ALL, 4 << 12 | 4 << 4),  # 18.4.7: channels 1, 2 forced low; no preload
    ("TIM5", CCMR1 + 1, ALL, 4 << 12 | 4 << 4),  # 18.4.8: channels 3, 4 forced low
    ("TIM2", CCER, ALL, 1 << 0 | 1 << 4 | 1 << 8),  # 18.4.9: outputs 1 to 3 on, active high
    ("TIM5", CCER, ALL, 1 << 0 | 1 << 8 | 1 << 12),  # 18.4.9: outputs 1, 3, 4 on, active high
    ("TIM2", SR, ALL, 0),  # 18.4.5: no flag is left
    ("TIM5", SR, ALL, 0),  # 18.4.5: no flag is left
)
PRIORITIES = (
    # with 4 bits of priority, 13 is TIM2's and 14 what MicroPython gives external interrupts
    ("NVIC_IPR", 5, 0xFF << 24, 12 << 28),  # PM0214 4.3.7: EXTI9_5 (limit switches) above TIM2
    ("NVIC_IPR", 13, 0xFF << 16, 14 << 20),  # PM0214 4.3.7: TIM6 (rings are filled) below TIM2
    ("NVIC_IPR", 10, 0xFF, 12 << 4),  # PM0214 4.3.7: EXTI15_10 (E-stop, limit switch) above TIM2
)
_NVIC_IPR = 0xE000E400  # not in MicroPython's table of addresses
ENCODER_CLOCK = {1: (_APB2ENR, 0), 8: (_APB2ENR, 1), 3: (_APB1ENR, 1), 4: (_APB1ENR, 2)}
_STREAM_MODE = 3 << 16 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8 | 1 << 6
_FLAG_SHIFT = (0, 6, 16, 22)


def encoder_rows(timer: int) -> "tuple[tuple[str, int, int, int], ...]":
    """Rows for a timer that counts an encoder: both edges of both inputs, filtered."""
    name = "TIM%d" % timer
    register, bit = ENCODER_CLOCK[timer]
    return (  # TIM3 and TIM4 (TIM1 and TIM8)
        ("RCC", register, 0, 1 << bit),  # 7.3.13 (7.3.14): clock
        (name, CR1, ALL, 0),  # 18.4.1 (17.4.1): stopped
        (name, SMCR, ALL, 3),  # 18.4.3 (17.4.3): SMS 011: encoder mode 3
        (name, PSC, ALL, 0),  # 18.4.11 (17.4.11): every count
        (name, ARR, ALL, 0xFFFF),  # 18.4.12 (17.4.12): 16 bits
        (name, CCMR1, ALL, 0x3131),  # 18.4.7 (17.4.7): inputs direct; ICxF 0011: 8 clocks alike
        (name, CCER, ALL, 0),  # 18.4.9 (17.4.9): rising polarity
        (name, EGR, 0, 1),  # 18.4.6 (17.4.6): UG: take prescaler and period over
        (name, CR1, ALL, 1),  # 18.4.1 (17.4.1): counting
    )


def stream_mode(dma_channel: int) -> int:
    """CR of a stream that feeds a compare register, still off (RM0090 10.5.5).

    Very high priority, words to words, memory incremented, circular, memory to peripheral.
    """
    return dma_channel << 25 | _STREAM_MODE


def stream_rows(
    stream: int, dma_channel: int, compare_address: int, ring_address: int
) -> "tuple[tuple[str, int, int, int], ...]":
    """Rows that point a DMA1 stream at a compare register and at its ring."""
    at = 4 + 6 * stream
    return (
        ("DMA1", at + STREAM_CR, ALL, 0),  # 10.5.5: off, so that it can be set up
        ("DMA1", at + STREAM_PAR, ALL, compare_address),  # 10.5.7: to the compare register
        ("DMA1", at + STREAM_M0AR, ALL, ring_address),  # 10.5.8: from the ring
        ("DMA1", at + STREAM_FCR, ALL, 0),  # 10.5.10: direct mode: one word fetched ahead
        ("DMA1", at + STREAM_CR, ALL, stream_mode(dma_channel)),  # 10.5.5: circular, words, still off
    )


def compare_address(timer: int, channel: int) -> int:
    """Address of a compare register."""
    return int(getattr(stm, "TIM%d" % timer)) + 4 * (CCR1 + channel - 1)


def stream_address(stream: int) -> int:
    """Address of a DMA1 stream's registers."""
    return stm.DMA1 + 0x10 + 0x18 * stream


def stream_flags(stream: int) -> "tuple[int, int]":
    """(address, value) that make a stream forget what it signalled: else it cannot be started (10.5.3)."""
    return stm.DMA1 + (12 if stream > 3 else 8), 0x3D << _FLAG_SHIFT[stream % len(_FLAG_SHIFT)]


def apply(rows: "tuple[tuple[str, int, int, int], ...]") -> None:
    """Write the rows in their order."""
    for block, register, clear, value in rows:
        address = getattr(stm, block, _NVIC_IPR) + 4 * register
        if clear == ALL:
            mem32[address] = value
        else:
            mem32[address] = mem32[address] & ~clear | value
