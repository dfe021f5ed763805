"""How long the outputs go on after an E-stop: its interrupt, triggered by software (EXTI_SWIER, RM0090 12.3.5)."""

_STARVE_US = 40_000


def trial(engine, wait_us, bit, idle_us):
    """Cycles from the trigger to the end of its interrupt, after so long in a motion; -1 where the outputs go on."""
    from armtempo_board.hardware import isr

    engine.start()
    then = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), then) < wait_us:
        serve(engine, idle_us)
    at = stm.EXTI + stm.EXTI_SWIER
    before = cycles()
    mem32[at] = bit
    took = (cycles() - before) & 0xFFFFFFFF
    return took if engine.block[isr.FROZEN] else -1


def starve(engine, motion, start_steps, idle_us):
    """The fault where the interrupt that fills the rings is held off (TIM6 stops); the motion lasts longer."""
    load(engine, motion, start_steps)
    engine.start()
    then = time.ticks_us()
    while engine.moving:
        serve(engine, idle_us)
        if time.ticks_diff(time.ticks_us(), then) > _STARVE_US:
            mem32[stm.TIM6] = 0
    fault = engine.fault
    engine.clear()
    return fault


def measure(record, motions, start_steps, rates, waits_us, idle_us):
    """Cycles of each trial, the writing of the register taken off; the fault of each.

    ``motions``: that of the trials, and the one in which the rings run dry, from step 0.
    """
    from binascii import unhexlify

    feed()
    count_cycles()
    engine, _ = make_engine(record, True, rates)
    nothing = min([trial_cost() for _ in range(5)])
    took = []
    faults = []
    motion, starved = [unhexlify(one) for one in motions]
    try:
        for wait_us in waits_us:
            load(engine, motion, start_steps)
            engine.skip_check = True  # the next ones are the same motion
            took.append(max(trial(engine, wait_us, 1 << _ESTOP_LINE, idle_us) - nothing, -1))
            while engine.moving:
                serve(engine, idle_us)
            faults.append(engine.fault)
            engine.clear()
            feed()
        engine.skip_check = False
        fault = starve(engine, starved, [0] * len(rates), idle_us)
    finally:
        engine.freeze()
        off = enable()
        engine.close()
    return {"cycles": took, "faults": faults, "starved": fault, "enable": off}


def trial_cost():
    """Cycles to write the register."""
    at = stm.EXTI + stm.EXTI_SWIER
    before = cycles()
    mem32[at] = 0
    return (cycles() - before) & 0xFFFFFFFF
