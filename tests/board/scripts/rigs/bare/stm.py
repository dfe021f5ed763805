"""Register blocks that are plain memory: nothing behind them moves.

Those of one row are as far from one another as on the chip (RM0090, table 1), as the program reaches one from another.
"""

from array import array

import uctypes

ROWS = (
    "TIM2 TIM3 TIM4 TIM5 TIM6",
    "GPIOA GPIOB GPIOC GPIOD GPIOE",
    "TIM1",
    "TIM8",
    "DMA1",
    "RCC",
    "PWR",
    "NVIC_IPR",
)
APART = 256
"""Words from one block of a row to the next; a block has fewer registers."""
BLOCKS = {"BKPSRAM": array("I", bytearray(4096))}
BKPSRAM = uctypes.addressof(BLOCKS["BKPSRAM"])
for _row in ROWS:
    _names = _row.split()
    _words = array("I", bytearray(4 * (APART * (len(_names) - 1) + 64)))
    for _number, _name in enumerate(_names):
        BLOCKS[_name] = memoryview(_words)[APART * _number : APART * _number + 64]
        globals()[_name] = uctypes.addressof(_words) + 4 * APART * _number
