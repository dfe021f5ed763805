"""The registers after start-up, before anything moves: one line each, all that are not zero."""

from chip import memory
from engine_rig import Rig, arm

rig = Rig([dict(joint, limit_low=0, limit_high=2) for joint in arm(6)])
rig.board.sync()
BLOCKS = "RCC TIM1 TIM2 TIM3 TIM4 TIM5 TIM6 TIM8 DMA1 GPIOA GPIOB GPIOC GPIOD GPIOE NVIC_IPR"
for block in BLOCKS.split():
    at = memory.index(block)
    for word in range(56):
        value = memory.words[at + word]
        stream = block == "DMA1" and word >= 4
        if stream and (word - 4) % 6 == 2:
            value = (value - memory.address("TIM2")) & memory.MASK  # compare registers, as seen from TIM2
        elif stream and (word - 4) % 6 == 3:
            value = 1 if value else 0  # wherever the ring is
        if value and not (block == "DMA1" and word >= 4 and memory.words[at + 4 + (word - 4) // 6 * 6] == 0):
            print("%s+%02x %08x" % (block, 4 * word, value))
