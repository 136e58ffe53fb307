"""torch's loader: the same batches with any number of workers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from shipwake import Dataset, simulate

torch = pytest.importorskip("torch", reason="torch is not installed: DataLoader is NOT tested")
from torch.utils.data import DataLoader  # noqa: E402


@pytest.fixture
def many() -> Dataset:
    changes = {"scene.grid.rows": 32, "scene.grid.columns": 32, "scene.grid.spacing": 20, "draw.count": 1}
    return Dataset("ranges", seed=5, count=14, changes=changes)


def images(loader: Any) -> list[Any]:
    return [(batch["index"].tolist(), batch["image"]) for batch in loader]


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_workers_change_nothing(many: Dataset, method: str, scene: Any) -> None:
    from shipwake.torch import Batches, collate

    # The pools of this process are in use before it forks.
    simulate(scene, threads=2)
    expected = images(DataLoader(many, batch_size=4, collate_fn=collate))
    assert [len(index) for index, _ in expected] == [4, 4, 4, 2]
    for workers in (0, 1, 2, 3):
        context = method if workers else None
        map_style = DataLoader(
            many, batch_size=4, collate_fn=collate, num_workers=workers, multiprocessing_context=context
        )
        iterable = DataLoader(Batches(many, 4), batch_size=None, num_workers=workers, multiprocessing_context=context)
        for loader in (map_style, iterable):
            found = images(loader)
            assert [index for index, _ in found] == [index for index, _ in expected]
            assert all(torch.equal(a, b) for (_, a), (_, b) in zip(found, expected, strict=True))


def test_a_run_goes_on_where_it_was(many: Dataset) -> None:
    from shipwake.torch import Batches

    whole = images(DataLoader(Batches(many, 4), batch_size=None, num_workers=2))
    rest = images(DataLoader(Batches(many, 4, start=2), batch_size=None, num_workers=2))
    assert len(Batches(many, 4, start=2)) == 2
    assert [index for index, _ in rest] == [index for index, _ in whole[2:]]


def test_shuffling_takes_the_same_images(many: Dataset) -> None:
    from shipwake.torch import collate

    loader = DataLoader(many, batch_size=5, shuffle=True, collate_fn=collate, num_workers=2)
    found = {}
    for index, batch in images(loader):
        found.update(zip(index, batch, strict=True))
    assert sorted(found) == list(range(14))
    for index, image in found.items():
        np.testing.assert_array_equal(image.numpy(), many[index]["image"])
