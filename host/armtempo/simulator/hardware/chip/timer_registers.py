"""Offsets of a timer's registers in words (RM0090 18.4.21), and the tick that stands for never."""

CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR = range(12)
CCR1 = 13
BDTR = 17
NEVER = 1 << 50
