"""Measures the package beside its own Rust code, and prints the rows of docs/python.md. On an idle machine:

    python tests/speed.py [simulate] [batch] [loader] [ray]

`simulate` compares the time of a call with the time that Rust measures inside it; `loader` and `ray` compare torch's loader and Ray with
`Dataset.write`, which is `wake dataset`. What is compared is measured in turn; the ratio is that of medians.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import shipwake

IMAGES = 200
TURNS = 3
CHANGES = {"speckle": True}


def seconds(work: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def row(*cells: object) -> None:
    print("|", " | ".join(str(cell) for cell in cells), "|", flush=True)


def simulate() -> None:
    for size in (64, 256, 512):
        scene = shipwake.Scene(grid={"rows": size, "columns": size})
        shipwake.simulate(scene)
        ratios, walls = [], []
        for seed in range(15 if size < 512 else 7):
            one = scene.with_values({"seed": seed})
            begin = time.perf_counter()
            made = shipwake.simulate(one)
            walls.append(time.perf_counter() - begin)
            ratios.append(walls[-1] / made.seconds["total"])
        row(f"simulate, {size} x {size}", f"{1e3 * statistics.median(walls):.1f} ms", f"{statistics.median(ratios):.3f}")


def batch() -> None:
    base = shipwake.Scene(grid={"rows": 128, "columns": 128})
    theta = np.linspace(5, 12, IMAGES)[:, None]
    for threads in (1, 2):
        shipwake.simulate_batch(theta[:4], ["ship.speed"], base=base, threads=threads)
        took = seconds(lambda: shipwake.simulate_batch(theta, ["ship.speed"], base=base, threads=threads))
        row(f"simulate_batch, 128 x 128, {threads} threads", f"{IMAGES / took:.1f} images/s")


def rates(ways: dict[str, Callable[[str], Any]], images: int = IMAGES) -> dict[str, float]:
    """Images a second of each way to make so many, by the median time of some turns; a way is given a new folder."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(TURNS):
        for name, way in ways.items():
            with tempfile.TemporaryDirectory() as folder:
                times[name].append(seconds(lambda: way(f"{folder}/set")))
    return {name: images / statistics.median(of) for name, of in times.items()}


def loader() -> None:
    from torch.utils.data import DataLoader

    from shipwake.torch import Batches, collate

    data = shipwake.Dataset("ranges", seed=7, count=IMAGES, changes=CHANGES)
    map_style = DataLoader(data, batch_size=8, num_workers=2, collate_fn=collate)
    iterable = DataLoader(Batches(data, 8), batch_size=None, num_workers=2)
    found = rates(
        {
            "`wake dataset`, 2 jobs": lambda folder: data.write(folder, threads=2),
            "DataLoader, map, 2 workers and their start": lambda _: list(map_style),
            "DataLoader, iterable, 2 workers and their start": lambda _: list(iterable),
        }
    )
    for name, rate in found.items():
        row(name, f"{rate:.1f} images/s", f"{rate / next(iter(found.values())):.2f}")


def ray() -> None:
    import ray

    from shipwake.ray import Simulate, write

    for workers in (1, 2):
        data = shipwake.Dataset("ranges", seed=7, count=300 * workers, changes=CHANGES)
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False, _system_config={"worker_niceness": 0})
        ray.data.DataContext.get_current().enable_progress_bars = False
        numbers = ray.data.range(len(data), override_num_blocks=8 * workers)
        write(shipwake.Dataset("ranges", count=workers, changes=CHANGES), tempfile.mkdtemp(), shards=workers)
        found = rates(
            {
                f"`wake dataset`, {workers} jobs": lambda folder: data.write(folder, threads=workers),
                f"Ray, {workers} workers, `write`": lambda folder: write(data, folder, shards=8 * workers),
                f"Ray, {workers} workers, `map_batches` to Parquet": lambda folder: numbers.map_batches(
                    Simulate(data), batch_size=10
                ).write_parquet(folder),
            },
            len(data),
        )
        for name, rate in found.items():
            row(name, f"{rate:.1f} images/s", f"{rate / next(iter(found.values())):.2f}")
        ray.shutdown()


if __name__ == "__main__":
    for name in sys.argv[1:] or ["simulate", "batch", "loader", "ray"]:
        {"simulate": simulate, "batch": batch, "loader": loader, "ray": ray}[name]()
