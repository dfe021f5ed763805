"""The search algorithms compared on joint 1 of the paper's job: many seeds on all cores, or on a Dask cluster.

Usage: python compare_searches.py [--algorithms cs,acs] [--populations 10,50] [--seeds 10] [--iterations 500]
[--scheduler tcp://HOST:PORT]; a cluster needs the extra 'cluster' here and armtempo on its workers. Prints a table and
writes searches.csv: the fitness of each run, in seconds.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
from armtempo import Arm, Job, optimise
from armtempo.planning.fitness import Fitness
from armtempo.splines import bspline


def one(algorithm: str, population: int, seed: int, iterations: int) -> float:
    """The shortest time that one run finds."""
    job = Job.paper()
    points = bspline.fit(np.array([via[:1] for via in job.via]), job.degree)
    fitness = Fitness(points, job.degree, [Arm.paper().driven[0].limits])
    settings = optimise.Settings(algorithm, population, iterations)
    bounds = [job.bounds_s] * fitness.intervals
    return optimise.minimise(fitness.stretched, bounds, np.random.default_rng(seed), settings).history[-1]


def main() -> None:
    """Run all cases, and write them down as they come."""
    options = argparse.ArgumentParser()
    options.add_argument("--algorithms", default=",".join(optimise.ALGORITHMS))
    options.add_argument("--populations", default="10,50,100,500")
    options.add_argument("--seeds", type=int, default=10)
    options.add_argument("--iterations", type=int, default=500)
    options.add_argument("--scheduler")
    chosen = options.parse_args()
    groups = list(product(chosen.algorithms.split(","), map(int, chosen.populations.split(","))))
    seeds = range(1, chosen.seeds + 1)
    cases = [(*group, seed, chosen.iterations) for group in groups for seed in seeds]
    if chosen.scheduler:
        from distributed import Client

        executor = Client(chosen.scheduler).get_executor(pure=False)
    else:
        executor = ProcessPoolExecutor()
    best_s = {}
    with executor, Path("searches.csv").open("w", encoding="utf-8") as table:
        table.write("algorithm,population,seed,best_s\n")
        for case, reached_s in zip(cases, executor.map(one, *zip(*cases, strict=True)), strict=True):
            table.write(f"{case[0]},{case[1]},{case[2]},{reached_s:.6f}\n")
            best_s[case] = reached_s
    print("algorithm  population    best s  median s   worst s")
    for group in groups:
        values = [best_s[*group, seed, chosen.iterations] for seed in seeds]
        figures = "".join(f"  {value:8.4f}" for value in (min(values), np.median(values), max(values)))
        print(f"{group[0]:<9}  {group[1]:>10}{figures}")


if __name__ == "__main__":
    main()
