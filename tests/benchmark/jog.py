"""Random held jogs on the virtual board: ``python -m tests.benchmark.jog --cases 1000``.

Each begins near the end of a range and is let go, falls silent, is cut off, or is held to its end. Says how many did
not come to rest within the stated time, or left a range, and how long the rest took at most, of the stated time.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections import Counter
from pathlib import Path

from tests.system.held_jogs import KINDS, HeldCase, HeldJogs


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    wanted = parser.parse_args()
    rng = random.Random(wanted.seed)
    done: Counter[str] = Counter()
    worst = dict.fromkeys(KINDS, 0.0)
    bad = 0
    with tempfile.TemporaryDirectory() as folder, HeldJogs.open(Path(folder)) as jogs:
        while sum(done.values()) < wanted.cases:
            case = HeldCase.random(rng)
            end = jogs.run(case)
            if end is None:
                continue
            done[case.kind] += 1
            worst[case.kind] = max(worst[case.kind], end.took_s / end.stated_s)
            if not end.good:
                bad += 1
                print("BAD", case, end, flush=True)
            if sum(done.values()) % 50 == 0:
                print(sum(done.values()), "done,", bad, "bad", flush=True)
    print(f"seed {wanted.seed}: {sum(done.values())} held jogs, {bad} bad")
    for kind in KINDS:
        print(
            f"{kind:<8} {done[kind]:>5}   at rest after at most {100 * worst[kind]:.0f} % of the stated time"
        )


if __name__ == "__main__":
    main()
