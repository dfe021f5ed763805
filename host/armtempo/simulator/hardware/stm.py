"""MicroPython's ``stm``: addresses of registers.

The blocks' addresses are those of their memory in this process; the offsets are the chip's (RM0090).
"""

from chip import memory as _memory

for _name in _memory.BLOCKS:
    globals()[_name] = _memory.address(_name)
BKPSRAM = _memory.backup_base  # like NVIC_IPR, not in MicroPython's table

_OFFSETS = {
    "TIM_": "CR1 CR2 SMCR DIER SR EGR CCMR1 CCMR2 CCER CNT PSC ARR RCR CCR1 CCR2 CCR3 CCR4 BDTR DCR DMAR OR",
    "GPIO_": "MODER OTYPER OSPEEDR PUPDR IDR ODR BSRR LCKR AFR0 AFR1",
    "DMA_": "LISR HISR LIFCR HIFCR",
    "RCC_": "CR PLLCFGR CFGR CIR AHB1RSTR AHB2RSTR AHB3RSTR - APB1RSTR APB2RSTR - - AHB1ENR AHB2ENR AHB3ENR"
    " - APB1ENR APB2ENR - - AHB1LPENR AHB2LPENR AHB3LPENR - APB1LPENR APB2LPENR - - BDCR CSR",
    "EXTI_": "IMR EMR RTSR FTSR SWIER PR",
    "SYSCFG_": "MEMRMP PMC EXTICR0 EXTICR1 EXTICR2 EXTICR3",
    "DBGMCU_": "IDCODE CR APB1FZ APB2FZ",
    "PWR_": "CR CSR",
    "IWDG_": "KR PR RLR SR",
    "RTC_": " ".join(["TR", "DR"] + ["-"] * 18 + ["BKP%dR" % number for number in range(20)]),
    "FLASH_": "ACR KEYR OPTKEYR SR CR OPTCR",
}
for _prefix, _names in _OFFSETS.items():
    for _number, _name in enumerate(_names.split()):
        globals()[_prefix + _name] = 4 * _number
GPIO_BSRRL = 0x18
GPIO_BSRRH = 0x1A
