"""E-stop and limit switches: hard interrupts that freeze the outputs; and the ENABLE output.

How long it takes from the edge to frozen outputs: docs/hardware.md. The pull resistors draw towards the tripped level,
so a switch that opens when it trips also trips when its wire breaks.
"""

from array import array

import micropython
import stm
from armtempo_shared import codes
from armtempo_shared.messages import NO_JOINT
from machine import disable_irq, enable_irq
from pyb import ExtInt, Pin

from armtempo_board.hardware import isr
from armtempo_board.hardware.sampler import Sampler

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable


class Inputs:
    """``head`` and ``joints``: the arm record's; ``sampler`` has the memory that the interrupts share."""

    def __init__(self, head: "dict[str, int]", joints: "list[dict[str, int]]", sampler: Sampler) -> None:
        from armtempo_shared import armrecord  # here, so that it can be forgotten

        from armtempo_board.hardware import pins

        flags = head["flags"]
        self._block = sampler.block
        self._timer2, self._timer5, self._port = stm.TIM2, stm.TIM5, stm.GPIOE
        self._step_ports = (stm.GPIOA, stm.GPIOB)
        self._on = 1 if flags & armrecord.FLAG_ENABLE_HIGH else 0
        self.enable_pin = Pin(pins.ENABLE, Pin.OUT_PP, value=1 - self._on)
        self.releases = bool(flags & armrecord.FLAG_ESTOP_RELEASES)
        self._estop = None
        self._limits: "list[tuple[Pin, int, int]]" = []  # pin, level when tripped, line
        self._pairs = array("I", bytearray(4 * isr.PAIR_WORDS * 2 * len(joints)))
        self._count = 0
        if flags & armrecord.FLAG_ESTOP_FITTED:
            self._estop_level = 1 if flags & armrecord.FLAG_ESTOP_ACTIVE_HIGH else 0
            self._estop = self._hook(pins.ESTOP, self._estop_level, self._on_estop)  # type: ignore[arg-type]
        self._add_limits(joints, armrecord.NONE)

    def _hook(self, name: str, level: int, callback: "Callable[[int], None]") -> Pin:
        mode = ExtInt.IRQ_RISING if level else ExtInt.IRQ_FALLING
        pull = Pin.PULL_UP if level else Pin.PULL_DOWN
        pin = Pin(name, Pin.IN, pull=pull)
        ExtInt(pin, mode, pull, None)  # removes an earlier engine's callback: a line takes only one
        ExtInt(pin, mode, pull, callback)
        return pin

    def _add_limits(self, joints: "list[dict[str, int]]", none: int) -> None:
        from armtempo_board.hardware import pins  # here, so that it can be forgotten

        fitted = {}
        for number, joint in enumerate(joints):
            for side, positive in (("limit_low", 0), ("limit_high", 1)):
                switch = joint[side]
                if switch == none:
                    continue
                fitted[switch] = joint["limit_active_high"]
                self._add_pair(number, joint, pins.line(pins.LIMIT[switch]), positive)
        for switch, level in fitted.items():
            pin = self._hook(pins.LIMIT[switch], level, self._on_limit)  # type: ignore[arg-type]
            self._limits.append((pin, level, pins.line(pins.LIMIT[switch])))

    def _add_pair(self, number: int, joint: "dict[str, int]", line: int, positive: int) -> None:
        from armtempo_board.hardware import pins  # here, so that it can be forgotten

        at = isr.PAIR_WORDS * self._count
        direction = pins.line(pins.DIR[joint["channel"]])
        for word, value in enumerate((line, direction, positive ^ joint["dir_inverted"], number, 0)):
            self._pairs[at + word] = value
        self._count += 1

    @micropython.viper
    def _freeze(self) -> object:
        if int(isr.freeze(self._block, self._timer2, self._timer5)):
            isr.finish_pulses(self._block, self._timer2, self._timer5, self._step_ports)

    @micropython.viper
    def _on_estop(self, line: object) -> object:
        self._freeze()
        isr.set_fault(self._block, codes.ESTOP, NO_JOINT)
        if self.releases:
            self.enable_pin.value(1 - int(self._on))

    @micropython.viper
    def _on_limit(self, line: object) -> object:
        joint = int(isr.joint_towards(self._pairs, self._count, line, isr.output_levels(self._port)))
        if joint:
            self._freeze()
            isr.set_fault(self._block, codes.LIMIT_SWITCH, joint - 1)

    def trip_estop(self) -> None:
        """As the E-stop's interrupt does."""
        self._on_estop(None)

    @micropython.viper
    def freeze(self) -> object:
        """Stop all outputs now."""
        before = disable_irq()
        self._freeze()
        enable_irq(before)

    def poll(self) -> None:
        """A switch that tripped before the joint turned towards it: its interrupt came too early."""
        for pin, level, line in self._limits:
            if pin.value() == level:
                self._on_limit(line)

    def watch(self, joint: int, moves: int) -> None:
        """A switch stops a joint only while it moves: ``moves`` 1 or 0."""
        for pair in range(self._count):
            if self._pairs[isr.PAIR_WORDS * pair + isr.PAIR_JOINT] == joint:
                self._pairs[isr.PAIR_WORDS * pair + isr.PAIR_MOVES] = moves

    def estop_active(self) -> bool:
        """Whether the E-stop is tripped at this moment."""
        return self._estop is not None and self._estop.value() == self._estop_level

    def enable(self, on: bool) -> None:
        """Drivers on or off."""
        self.enable_pin.value(self._on if on else 1 - self._on)

    def close(self) -> None:
        """Remove the interrupts' callbacks; drivers off."""
        self.enable(False)
        for pin, _, _ in self._limits:
            ExtInt(pin, ExtInt.IRQ_RISING, Pin.PULL_NONE, None)
        if self._estop:
            ExtInt(self._estop, ExtInt.IRQ_RISING, Pin.PULL_NONE, None)
