"""E-stop and limit switches: hard interrupts that freeze the outputs; and the ENABLE output.

The interrupts' callback (``isr.freezer``) only stops the outputs and releases the drivers. The main loop
determines the switch and the fault when it finds the outputs frozen. Switches on other pins have no
interrupt: ``poll_home`` reads them during a homing motion, and those that the joints do not move to. Time
from the edge to frozen outputs: docs/hardware.md. The pull resistors pull to the tripped level, so a
normally closed switch also trips when its wire breaks.
"""

import micropython
import stm
from armtempo_shared import armrecord, codes
from armtempo_shared.messages import NO_JOINT, OTHER_SWITCH
from machine import disable_irq, enable_irq
from pyb import ExtInt, Pin

from armtempo_board.hardware import isr, pins
from armtempo_board.hardware.sampler import Sampler

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable


class Inputs:
    """``head`` and ``joints``: of the arm record; ``sampler`` has the memory that the interrupts share."""

    def __init__(self, head: "dict[str, int]", joints: "list[dict[str, int]]", sampler: Sampler) -> None:
        flags = head["flags"]
        self._block = sampler.block
        self._port = stm.GPIOE
        self.on_level = 1 if flags & armrecord.FLAG_ENABLE_HIGH else 0
        self.enable_pin = Pin(pins.ENABLE, Pin.OUT_PP, value=1 - self.on_level)
        self.releases = bool(flags & armrecord.FLAG_ESTOP_RELEASES)
        self._estop = None
        self._estop_line = pins.line(pins.ESTOP)
        self._limits: "list[tuple[Pin, int, int]]" = []  # pin, level when tripped, line
        self._towards: "list[tuple[int, int, int, int]]" = []  # line, bit of DIR, its level, joint
        self._polled: "list[tuple[Pin, int, int, int, int]]" = []  # pin, level when tripped, and as above
        self._others: "list[tuple[Pin, int, int, int, int]]" = []  # as above, in a homing motion
        self._seen = NO_JOINT  # joint of the one of them that was tripped in the last poll
        self._freeze = self._make_freezer()
        if flags & armrecord.FLAG_ESTOP_FITTED:
            self._estop_level = 1 if flags & armrecord.FLAG_ESTOP_ACTIVE_HIGH else 0
            self._set_line(self._estop_line, isr.ALWAYS, isr.ALWAYS)
            if self.releases:
                self._block[self._line_at(self._estop_line) + isr.LINE_RELEASE] = self._release_word()
            self._estop = self._hook(pins.ESTOP, self._estop_level)
        self._add_limits(joints)

    def _make_freezer(self) -> "Callable[[int], object]":
        block = self._block
        block[isr.TIM2_AT] = stm.TIM2 & 0x3FFFFFFF
        block[isr.TIM2_AT + 1] = stm.TIM2 >> 30
        block[isr.PORT_A_OFFSET] = stm.GPIOA - stm.TIM2
        self._set_line(isr.SOFTWARE_LINE, isr.ALWAYS, isr.ALWAYS)
        return isr.freezer(block)

    def _release_word(self) -> int:
        bit = 1 << pins.line(pins.ENABLE)
        return bit << 16 if self.on_level else bit  # the upper half of BSRR clears

    def _hook(self, name: str, level: int) -> Pin:
        mode = ExtInt.IRQ_RISING if level else ExtInt.IRQ_FALLING
        pull = Pin.PULL_UP if level else Pin.PULL_DOWN
        pin = Pin(name, Pin.IN, pull=pull)
        ExtInt(pin, mode, pull, None)  # removes an earlier engine's callback, as a line has only one
        ExtInt(pin, mode, pull, self._freeze)  # type: ignore[arg-type]  # what it returns does not matter
        return pin

    def _add_limits(self, joints: "list[dict[str, int]]") -> None:
        fitted = {}
        for number, joint in enumerate(joints):
            bit = 1 << pins.line(pins.DIR[joint["channel"]])
            for side, positive in (("limit_low", 0), ("limit_high", 1)):
                switch = joint[side]
                if switch == armrecord.NONE:
                    continue
                active = joint["limit_active_high"]
                level = positive ^ joint["dir_inverted"]
                if switch >= armrecord.POLLED:
                    pull = Pin.PULL_UP if active else Pin.PULL_DOWN
                    pin = Pin(pins.name(switch - armrecord.POLLED), Pin.IN, pull=pull)
                    self._polled.append((pin, active, bit, level, number))
                    continue
                fitted[switch] = active
                self._towards.append((pins.line(pins.LIMIT[switch]), bit, level, number))
        for switch, level in fitted.items():
            self._limits.append((self._hook(pins.LIMIT[switch], level), level, pins.line(pins.LIMIT[switch])))

    def _line_at(self, line: int) -> int:
        return isr.FIRST_LINE + (line - isr.SOFTWARE_LINE) * isr.LINE_WORDS

    def _set_line(self, line: int, levels: int, mask: int) -> None:
        """Set the condition at which the interrupt of a line freezes; the interrupt may occur during this."""
        at = self._line_at(line)
        self._block[at + isr.LINE_MASK] = 0
        self._block[at + isr.LINE_LEVELS] = levels
        self._block[at + isr.LINE_MASK] = mask

    def watch(self, moving: int) -> None:
        """Let switches stop the ``moving`` joints (one bit per joint)."""
        for _, _, line in self._limits:
            levels = mask = 0
            for pair_line, bit, level, joint in self._towards:
                if pair_line == line and moving >> joint & 1:
                    if mask & bit:  # one switch at both ends
                        bit = isr.ALWAYS
                        level = 0
                    mask |= bit
                    levels |= 0 if level else bit
            self._set_line(line, levels, mask)

    def trip_estop(self) -> None:
        """Do what the E-stop's interrupt does."""
        self._trip(self._estop_line)

    @micropython.viper
    def freeze(self) -> object:
        """Stop all outputs; also called by interrupts."""
        trip = self._trip
        trip(isr.SOFTWARE_LINE)

    @micropython.viper
    def _trip(self, line: int) -> object:
        before = disable_irq()
        self._freeze(line)
        enable_irq(before)

    def thaw(self) -> None:
        """Allow motion again."""
        self._block[isr.FROZEN] = 0

    def poll(self) -> None:
        """Freeze at a switch that tripped before the joint turned towards it, whose interrupt was too early."""
        for pin, level, line in self._limits:
            if pin.value() == level:
                self._trip(line)

    def watch_others(self, moving: int) -> None:
        """Let ``poll_home`` look also at switches that are not tripped now and that the ``moving`` joints (bits; 0: no
        switches) do not move to."""
        self._seen = NO_JOINT
        self._others = []
        if not moving:
            return
        lines = {line: (pin, active) for pin, active, line in self._limits}
        switches = list(self._polled)
        for line, bit, level, joint in self._towards:
            pin, active = lines[line]
            switches.append((pin, active, bit, level, joint))
        own = [pin.name() for pin, _, _, _, joint in switches if moving >> joint & 1]
        for pin, active, bit, level, joint in switches:
            if pin.value() != active and (moving >> joint & 1 or pin.name() not in own):
                self._others.append((pin, active, bit, level, joint))

    def poll_home(self, moving: int) -> None:
        """Freeze if a switch without an interrupt is tripped and one of the ``moving`` joints (bits) moves
        towards it, or if one of ``watch_others`` is in two calls, and none does."""
        levels = isr.output_levels(self._port)
        for pin, active, bit, level, joint in self._polled:
            if moving >> joint & 1 and (levels & bit != 0) == level and pin.value() == active:
                isr.set_fault(self._block, codes.LIMIT_SWITCH, joint)
                self.freeze()
        seen = NO_JOINT
        for pin, active, bit, level, joint in self._others:
            if pin.value() == active and not (moving >> joint & 1 and (levels & bit != 0) == level):
                if joint == self._seen:
                    isr.set_fault(self._block, codes.LIMIT_SWITCH, joint | OTHER_SWITCH)
                    self.freeze()
                seen = joint
        self._seen = seen

    def note_trip(self) -> bool:
        """Note the fault of a switch that tripped since the last call, the E-stop first; returns whether it
        was the E-stop."""
        for _, _, line in self._limits:
            if self._has_tripped(line):
                isr.set_fault(self._block, codes.LIMIT_SWITCH, self._joint_towards(line))
        if not self._has_tripped(self._estop_line):
            return False
        self._block[isr.FAULT] = 0
        isr.set_fault(self._block, codes.ESTOP, NO_JOINT)
        return True

    def _has_tripped(self, line: int) -> bool:
        at = self._line_at(line) + isr.LINE_TRIPPED
        tripped = self._block[at] != 0
        if tripped:
            self._block[at] = 0
        return tripped

    def _joint_towards(self, line: int) -> int:
        """The first joint that moves towards a switch."""
        levels = isr.output_levels(self._port)  # DIR does not change after a freeze
        for pair_line, bit, level, joint in self._towards:
            if pair_line == line and (levels & bit != 0) == level:
                return joint
        return NO_JOINT

    def estop_active(self) -> bool:
        """Whether the E-stop is tripped."""
        return self._estop is not None and self._estop.value() == self._estop_level

    def enabled(self) -> bool:
        """Whether the drivers are on."""
        return int(self.enable_pin.value()) == self.on_level

    def enable(self, on: bool) -> None:
        """Drivers on or off."""
        self.enable_pin.value(self.on_level if on else 1 - self.on_level)

    def close(self) -> None:
        """Remove the interrupts' callbacks; drivers off."""
        self.enable(False)
        for pin, _, _ in self._limits:
            ExtInt(pin, ExtInt.IRQ_RISING, Pin.PULL_NONE, None)
        if self._estop:
            ExtInt(self._estop, ExtInt.IRQ_RISING, Pin.PULL_NONE, None)
