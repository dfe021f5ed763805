"""Register blocks that are plain memory: nothing behind them moves."""

from array import array

import uctypes

NAMES = "TIM1 TIM2 TIM3 TIM4 TIM5 TIM6 TIM8 GPIOA GPIOB GPIOC GPIOD GPIOE DMA1 RCC PWR NVIC_IPR"
BLOCKS = {name: array("I", bytearray(256)) for name in NAMES.split()}
BLOCKS["BKPSRAM"] = array("I", bytearray(4096))
for _name, _block in BLOCKS.items():
    globals()[_name] = uctypes.addressof(_block)
