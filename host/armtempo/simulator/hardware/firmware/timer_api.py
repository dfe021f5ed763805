"""``pyb.Timer`` and its channels on the simulated timers; they write the same registers as the firmware (timer.c)."""

import machine_state
from chip import gpio, memory, timers
from chip.processor import _RCC_TIMERS, CALL_TICKS

from firmware.pin_api import Pin

_ENCODER = {9: 1, 10: 2, 11: 3}
_OC_MODES = {0: 6, 1: 7, 2: 0, 3: 1, 4: 2, 5: 3, 6: 5, 7: 4}


def _change(at, mask, value):
    memory.words[at] = memory.words[at] & ~mask & memory.MASK | value


class Timer:
    """A hardware timer; ``Timer(n)`` is always the same object."""

    UP, DOWN, CENTER = 0, 0x10, 0x20
    PWM, PWM_INVERTED, OC_TIMING, OC_ACTIVE, OC_INACTIVE, OC_TOGGLE = range(6)
    OC_FORCED_ACTIVE, OC_FORCED_INACTIVE, IC, ENC_A, ENC_B, ENC_AB = range(6, 12)
    HIGH, LOW = 0, 2
    RISING, FALLING, BOTH = 0, 2, 10

    def __new__(cls, number, *args, **kwargs):
        known = machine_state.board.api.get(number)
        if known is None:
            if number not in machine_state.board.timers:
                raise ValueError("Timer(%d) doesn't exist on the virtual board" % number)
            known = super().__new__(cls)
            known._made = False
            machine_state.board.api[number] = known
        return known

    def __init__(self, number, *args, **kwargs):
        if not self._made:
            self._made = True
            self._number = number
            self._model = machine_state.board.timers[number]
            self._channels = {}
        if args or kwargs:
            self.init(*args, **kwargs)

    def init(self, freq=None, prescaler=None, period=None, mode=0, div=1, callback=None):
        """Clock the timer, set prescaler and period (from ``freq`` if given) and start it."""
        if mode != self.UP or div != 1:
            raise ValueError("the virtual board's timers count up, undivided")
        if freq is not None:
            prescaler, period = self._from_freq(freq)
        elif prescaler is None or period is None:
            raise TypeError("must specify either freq, or prescaler and period")
        register, bit = _RCC_TIMERS[self._number]
        _change(memory.index("RCC") + register, 0, 1 << bit)
        at = self._model.at
        memory.words[at + timers.PSC] = prescaler & 0xFFFF
        memory.words[at + timers.ARR] = period & (self._model.full - 1)
        memory.words[at + timers.CR1] = 0x80
        memory.words[at + timers.EGR] = 1
        machine_state.board.sync()
        _change(at + timers.CR1, 1, 1)
        self.callback(callback)
        machine_state.board.spend(20 * CALL_TICKS)

    def _from_freq(self, freq):
        clocks = self.source_freq() // int(freq)
        prescaler = 0
        while clocks // (prescaler + 1) > self._model.full:
            prescaler += 1
        return prescaler, clocks // (prescaler + 1) - 1

    def deinit(self):
        """Stop the timer and its outputs."""
        self.callback(None)
        for channel in self._channels.values():
            channel.callback(None)
        self._channels.clear()
        memory.words[self._model.at + timers.CCER] = 0
        memory.words[self._model.at + timers.CR1] = 0
        machine_state.board.wrote()

    def source_freq(self):
        """Clock of the timer before its prescaler, in Hz."""
        return 84_000_000 * self._model.rate

    def callback(self, function):
        """Set the callback ``function(timer)`` of update events; None: remove it."""
        self.interrupt(0, function)

    def interrupt(self, flag, function):
        """Set or clear the callback of one interrupt flag."""
        if function is None:
            machine_state.board.callbacks.pop((self._number, flag), None)
            _change(self._model.at + timers.DIER, 1 << flag, 0)
        else:
            machine_state.board.callbacks[(self._number, flag)] = (function, self)
            _change(self._model.at + timers.SR, 1 << flag, 0)
            _change(self._model.at + timers.DIER, 0, 1 << flag)
        machine_state.board.wrote()

    def register(self, at, value=None):
        """Read a register (signed, as the firmware does) or write it."""
        where = self._model.at + at
        if value is None:
            machine_state.board.call()
            value = memory.words[where]
            return value - (1 << 32) if value >> 31 else value
        memory.words[where] = value & memory.MASK
        machine_state.board.wrote()
        return None

    def counter(self, value=None):
        return self.register(timers.CNT, value)

    def period(self, value=None):
        return self.register(timers.ARR, value)

    def prescaler(self, value=None):
        return self.register(timers.PSC, value)

    def channel(self, number, mode=None, callback=None, pin=None, compare=0, polarity=0, pulse_width=0):
        """Set up a channel; without a mode, return the one set up before."""
        if not 1 <= number <= 4:
            raise ValueError("invalid channel (%d)" % number)
        if mode is None:
            return self._channels.get(number)
        if pin is not None:
            self._route(pin)
        channel = TimerChannel(self, number)
        self._channels[number] = channel
        if mode == self.PWM:
            channel.setup_compare(_OC_MODES[mode], pulse_width, polarity, callback)
        elif mode in _ENCODER:
            channel.setup_encoder(_ENCODER[mode])
        elif mode in _OC_MODES and mode > 1:
            channel.setup_compare(_OC_MODES[mode], compare, polarity, callback)
        else:
            raise ValueError("the virtual board has no such channel mode")
        machine_state.board.spend(20 * CALL_TICKS)
        return channel

    def _route(self, pin):
        for (name, function), (timer, _) in gpio.TIMER_PINS.items():
            if name == pin.name() and timer == self._number:
                pin.init(Pin.AF_PP, alt=function)
                return
        raise ValueError("Pin(%s) doesn't have an alt for Timer(%d)" % (pin.name(), self._number))

    def start(self):
        """Set the counter-enable bit."""
        _change(self._model.at + timers.CR1, 1, 1)


class TimerChannel:
    """One channel of a timer."""

    def __init__(self, timer, number):
        self._timer = timer
        self._number = number
        self._at = timer._model.at

    def setup_encoder(self, mode):
        """Count the edges of two inputs."""
        self._timer.register(timers.SMCR, mode)
        self._timer.register(timers.CCMR1, 0x0101)
        _change(self._at + timers.CCER, 0xBB, 0x11)
        self._timer.start()

    def setup_compare(self, mode, compare, polarity, callback):
        """Output compare; also starts the counter, as in the firmware."""
        number = self._number - 1
        _change(self._at + timers.CCER, 3 << 4 * number, polarity << 4 * number)
        shift = 8 * (number & 1)
        _change(self._at + timers.CCMR1 + (number >> 1), 0xFF << shift, mode << 4 + shift)
        memory.words[self._at + timers.CCR1 + number] = compare & memory.MASK
        _change(self._at + timers.CCER, 0, 1 << 4 * number)
        if self._timer._number in (1, 8):
            _change(self._at + timers.BDTR, 0, 1 << 15)  # MOE
        self._timer.start()
        if callback:
            self.callback(callback)

    def callback(self, function):
        """Set the callback ``function(timer)`` of matches; None: remove it."""
        self._timer.interrupt(self._number, function)

    def compare(self, value=None):
        return self._timer.register(timers.CCR1 + self._number - 1, value)

    capture = compare
    pulse_width = compare
