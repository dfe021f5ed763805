"""Whether the joints keep up with a step rate: a motion that reaches it, with the engine's loop and nothing else."""


def measure(record, motion, rates, idle_us):
    """The first joints of the arm, one for each of ``rates``, from step 0 on: fault, turns of the loop, the longest."""
    from array import array
    from binascii import unhexlify

    feed()
    count_cycles()
    engine, _ = make_engine(record, rates=rates)
    sample = array("i", [0] * 32)
    longest = turns = 0
    try:
        load(engine, unhexlify(motion), [0] * len(rates))
        engine.start()
        then = cycles()
        while engine.moving:
            serve(engine, idle_us)
            engine.next_sample(sample)
            now = cycles()
            longest = max(longest, (now - then) & 0xFFFFFFFF)
            then = now
            turns += 1
    finally:
        engine.freeze()
        off = enable()
        engine.close()
    return {"fault": engine.fault, "turns": turns, "longest_turn_cycles": longest, "enable": off}
