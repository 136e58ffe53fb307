"""Measures the package beside its own Rust code, and prints the rows of docs/python.md. On an idle machine:

    python tests/speed.py [simulate] [batch] [loader]

`simulate` compares the time of a call with the time that Rust measures inside it; `loader` compares torch's loader with `Dataset.write`, which is
`wake dataset`.
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

IMAGES = 64
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


def loader() -> None:
    from torch.utils.data import DataLoader

    from shipwake.torch import Batches, collate

    data = shipwake.Dataset("ranges", seed=7, count=IMAGES, changes=CHANGES)
    rates: dict[str, list[float]] = {"write": [], "map": [], "iterable": []}
    for _ in range(3):
        with tempfile.TemporaryDirectory() as folder:
            rates["write"].append(IMAGES / seconds(lambda: data.write(folder, threads=2)))
        loaders = {
            "map": DataLoader(data, batch_size=8, num_workers=2, collate_fn=collate),
            "iterable": DataLoader(Batches(data, 8), batch_size=None, num_workers=2),
        }
        for name, batches in loaders.items():
            rates[name].append(IMAGES / seconds(lambda: list(batches)))
    write = statistics.median(rates["write"])
    row("`wake dataset`, 2 jobs", f"{write:.1f} images/s", 1)
    for name in ("map", "iterable"):
        rate = statistics.median(rates[name])
        row(f"DataLoader, {name}, 2 workers, their start included", f"{rate:.1f} images/s", f"{rate / write:.2f}")


if __name__ == "__main__":
    for name in sys.argv[1:] or ["simulate", "batch", "loader"]:
        {"simulate": simulate, "batch": batch, "loader": loader}[name]()
