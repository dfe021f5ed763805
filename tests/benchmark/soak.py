"""Sequences at every speed under random operation: ``python -m tests.benchmark.soak [--legs N] [--minutes M]``.

``--legs``: motions in virtual time (tests/system/scripts/cases/soak.py), 500 for each seed from ``--seed`` on.
``--minutes``: the shipped pick and place, repeated for ever on a virtual board in real time, while hosts come, pause
it, change its speed and are killed. Either way the steps on the pins are compared with those of each motion's record.
"""

from __future__ import annotations

import argparse
import itertools
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import armtempo
from armtempo.basics.errors import BoardError
from armtempo.encoding import encoded_plan
from armtempo.model.sequence import Sequence
from armtempo.simulator import LaunchOptions, edgelog, launch

from tests import interpreters
from tests.system import sequences
from tests.system.replays import PINS
from tests.system.sequences import ARM, FOLDER, part_lies_there

PER_SEED = 500
FOR_EVER = ("repeat = 2", 'repeat = "for ever"')
LEADING, REPEATED = 1, 6
"""Motions of the pick and place before the repeat and in it; the last one brings the arm home, which never comes."""


def in_virtual_time(legs: int, seed: int, interpreter: str, folder: Path) -> None:
    """Many motions; AssertionError at the first that makes other steps than its record has."""
    sequences.make_flash(folder / "flash")
    for number in range(-(-legs // PER_SEED)):
        print(sequences.soak(interpreter, folder / "flash", PER_SEED, seed + number).strip(), flush=True)


def in_real_time(minutes: float, numbers: random.Random, interpreter: str, folder: Path) -> None:
    """Hosts that come and go while it moves, then the edge log against the records."""
    text = (FOLDER / "sequence.toml").read_text().replace(*FOR_EVER)
    path = folder / "sequence.toml"
    path.write_text(text.replace('"arm.toml"', f'"{FOLDER / "arm.toml"}"'))
    plan = armtempo.plan_sequence(ARM, Sequence.load(path, ARM))
    options = LaunchOptions(
        arm=ARM,
        faults=[part_lies_there()],
        edge_log=folder / "edges",
        interpreter=interpreters.starter(interpreter),
    )
    done: Counter[str] = Counter()
    with launch(options) as process:
        with armtempo.connect(process.port, ARM) as board:
            board.home(ARM)
            key = board.upload_sequence(plan)
            board.speed(0.9)
            board.client.start(key.name, key.crc)
        end_s = time.monotonic() + 60 * minutes
        while time.monotonic() < end_s:
            _killed(process.port, numbers)
            done["killed"] += 1
            with armtempo.connect(process.port, ARM) as board:
                for _ in range(numbers.randrange(1, 6)):
                    done[_something(board, numbers)] += 1
                assert board.client.sequence().ending == "running", board.state()
        with armtempo.connect(process.port, ARM) as board:
            board.stop()
            assert board.client.sequence().ending == "stopped"
    (power,) = edgelog.read(folder / "edges")
    motions = encoded_plan.of_plan(plan).legs
    order = [
        *range(LEADING),
        *itertools.islice(itertools.cycle(range(LEADING, LEADING + REPEATED)), len(power.starts)),
    ]
    expected = [sequences.steps_in_order(motion) for motion in motions]
    for number in range(len(power.starts) - 1):  # the last one was stopped
        made = [_made(power, number, joint) for joint in range(len(PINS))]
        assert made == expected[order[number]], (number, made, expected[order[number]])
    print(f"{interpreter}: {len(power.starts)} motions, {dict(done)}")


def _killed(port: str, numbers: random.Random) -> None:
    """A host that is killed, as it starts or while it watches."""
    command = (
        sys.executable,
        "-m",
        "armtempo",
        numbers.choice(("watch", "status", "monitor")),
        "--port",
        port,
    )
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as host:
        time.sleep(numbers.uniform(0.3, 4.0))
        host.kill()


def _something(board: armtempo.Board, numbers: random.Random) -> str:
    """What a user does, some time from now."""
    time.sleep(numbers.uniform(0.0, 0.8))
    what = numbers.choice(("speed", "pause", "status"))
    try:
        if what == "speed":
            board.speed(numbers.choice((1.0, numbers.uniform(0.2, 1.0))))
        elif what == "status":
            board.status()
        else:
            board.pause()
            time.sleep(numbers.uniform(0.0, 1.5))
            board.resume()
    except BoardError as error:  # between two motions nothing can be paused
        return f"{what}: {error.problem}"
    return what


def _made(power: edgelog.PowerCycle, number: int, joint: int) -> list[int]:
    """Steps of a joint in a motion, as ``sequences.steps_in_order`` has them."""
    (step, direction), motor = PINS[joint], ARM.driven[joint].motor
    zero = power.starts[number]
    ticks, levels = power.motion(number).get(step, ((), ()))
    turns, after = power.pins.get(direction, ((), ()))
    runs: list[int] = []
    at, level = 0, 0 if not len(after) else 1 - int(after[0])
    for tick, risen in zip(ticks, levels, strict=True):
        while at < len(turns) and turns[at] <= zero + tick:
            level = int(after[at])
            at += 1
        if risen:
            way = motor.direction * (1 if level else -1)
            if runs and (runs[-1] > 0) == (way > 0):
                runs[-1] += way
            else:
                runs.append(way)
    return runs


def main() -> None:
    """Read the arguments, run."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--legs", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--interpreter", default="micropython", choices=interpreters.AVAILABLE)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        if given.legs:
            in_virtual_time(given.legs, given.seed, given.interpreter, Path(name))
        if given.minutes:
            in_real_time(given.minutes, random.Random(given.seed), given.interpreter, Path(name))


if __name__ == "__main__":
    main()
