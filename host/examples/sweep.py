"""A thousand random jobs: how long does this arm take for a move of a given distance?

Usage: python sweep.py [--jobs 1000] [--scheduler tcp://HOST:PORT]; a Dask cluster needs the extra 'cluster' here and
armtempo on its workers. Without one, all cores of this machine. Writes sweep.csv.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import armtempo
import numpy as np


def one(seed: int) -> tuple[int, float, float]:
    """(seed, farthest way of a joint in degrees, time in seconds) of a random move within the ranges."""
    arm = armtempo.Arm.paper()
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    ends = np.random.default_rng(seed).uniform(0.9 * low, 0.9 * high, size=(2, len(low)))
    job = armtempo.Job(f"move-{seed}", via_deg=ends.tolist(), seed=seed)
    return seed, float(np.abs(ends[1] - ends[0]).max()), armtempo.plan(arm, job).total_s


def main() -> None:
    """Plan all jobs and write them down as they come."""
    options = argparse.ArgumentParser()
    options.add_argument("--jobs", type=int, default=1000)
    options.add_argument("--scheduler")
    chosen = options.parse_args()
    if chosen.scheduler:
        from distributed import Client

        executor = Client(chosen.scheduler).get_executor()
    else:
        executor = ProcessPoolExecutor()
    with executor, Path("sweep.csv").open("w", encoding="utf-8") as table:
        table.write("seed,way_deg,time_s\n")
        for done, (seed, way_deg, time_s) in enumerate(executor.map(one, range(chosen.jobs)), 1):
            table.write(f"{seed},{way_deg:.3f},{time_s:.4f}\n")
            print(f"\r{done} of {chosen.jobs}", end="", flush=True)
    print()
    print(f"wrote sweep.csv, {chosen.jobs} moves")


if __name__ == "__main__":
    main()
