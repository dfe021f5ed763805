"""How long the outputs go on after an E-stop: by its software trigger (EXTI_SWIER, RM0090 12.3.5), by a real edge."""

_STARVE_US = 40_000
_MOST_LOOKS = 100


def stopped(engine, at, value):
    """Cycles from writing a register until the E-stop's interrupt has ended; -1 where the outputs go on."""
    from armtempo_board.hardware.isr import FROZEN

    block = engine.block
    looks = 0
    before = cycles()
    mem32[at] = value
    while True:
        frozen = block[FROZEN]
        after = cycles()
        looks += 1
        if frozen:
            return (after - before) & 0xFFFFFFFF
        if looks == _MOST_LOOKS:
            return -1


def cost_of_looking(engine, at, value):
    """The same where nothing has to be waited for, and nothing is triggered."""
    from armtempo_board.hardware.isr import FROZEN

    engine.block[FROZEN] = 1
    fewest = min([stopped(engine, at, value) for _ in range(5)])
    engine.block[FROZEN] = 0
    return fewest


def serve_for(engine, wait_us, idle_us):
    """Turns of the loop for so long."""
    then = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), then) < wait_us:
        serve(engine, idle_us)


def is_drawn(engine):
    """Whether the pull resistor moves the input: nothing is wired to it, so an edge can be made."""
    mem32[_PULLS] = pulls(engine, 1)
    time.sleep_ms(1)
    drawn = engine.inputs.estop_active()
    pull_inactive(engine)
    return drawn


def starve(engine, joints, motion, start_steps, idle_us):
    """What becomes of a motion that lasts longer where the interrupt that fills the rings is held off (TIM6 stops)."""
    from armtempo_board.hardware import pins

    load(engine, motion, start_steps)
    engine.start()
    serve_for(engine, _STARVE_US, idle_us)
    mem32[stm.TIM6] = 0
    while engine.moving:
        serve(engine, idle_us)
    high = 0
    for joint in joints:
        pin = pins.STEP[joint["channel"]][0]
        high |= mem32[getattr(stm, "GPIO" + pins.port(pin)) + stm.GPIO_IDR] >> pins.line(pin) & 1
    end = {"fault": engine.fault, "low": not high, "known": engine.known == (1 << len(start_steps)) - 1}
    engine.clear()
    return end


def measure(record, motions, start_steps, rates, waits_us, idle_us):
    """Cycles of each trial, the reading of the counter taken off; the fault of each.

    Every second one is by an edge, where the input is free. ``motions``: that of the trials, and the one in which the
    rings run dry, from step 0.
    """
    from binascii import unhexlify

    feed()
    count_cycles()
    engine, joints = make_engine(record, True, rates)
    triggers = [(stm.EXTI + stm.EXTI_SWIER, 1 << _ESTOP_LINE, 0)]
    took = [[], []]
    faults = []
    motion, starved = [unhexlify(one) for one in motions]
    try:
        if is_drawn(engine):
            triggers.append((_PULLS, pulls(engine, 1), pulls(engine, 0)))
        nothing = [cost_of_looking(engine, at, rest) for at, _, rest in triggers]
        for number, wait_us in enumerate(waits_us):
            way = number % len(triggers)
            at, trip, rest = triggers[way]
            load(engine, motion, start_steps)
            engine.skip_check = True  # the next ones are the same motion
            engine.start()
            serve_for(engine, wait_us, idle_us)
            cycles_taken = stopped(engine, at, trip)
            mem32[at] = rest
            took[way].append(max(cycles_taken - nothing[way], -1))
            while engine.moving:
                serve(engine, idle_us)
            faults.append(engine.fault)
            engine.clear()
            feed()
        engine.skip_check = False
        end = starve(engine, joints, starved, [0] * len(rates), idle_us)
    finally:
        engine.freeze()
        off = enable()
        engine.close()
    return {"cycles": took[0], "edge_cycles": took[1], "faults": faults, "starved": end, "enable": off}
