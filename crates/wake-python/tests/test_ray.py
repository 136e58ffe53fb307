"""A local cluster of Ray with two workers, one of which is killed: the same bytes as one process makes."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shipwake import Dataset

ray = pytest.importorskip("ray", reason="ray is not installed: shipwake.ray is NOT tested")

CHANGES = {"scene.grid.rows": 32, "scene.grid.columns": 32, "scene.grid.spacing": 20, "draw.count": 1}


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, object_store_memory=200_000_000)
    yield
    ray.shutdown()


def by_index(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=lambda row: row["index"])


def test_a_killed_worker_changes_no_byte(cluster: None, tmp_path: Path) -> None:
    from shipwake.ray import Simulate

    class Slow(Simulate):
        """Notes its process, and leaves time to kill it."""

        def __call__(self, batch: Any) -> dict[str, Any]:
            (tmp_path / f"{os.getpid()}.pid").touch()
            time.sleep(0.3)
            return super().__call__(batch)

    expected = Simulate(seed=5, changes=CHANGES)({"id": np.arange(40)})
    rows = ray.data.range(40, override_num_blocks=10).map_batches(
        Slow,
        fn_constructor_kwargs={"seed": 5, "changes": CHANGES},
        batch_size=4,
        concurrency=2,
        max_restarts=5,
        max_task_retries=5,
    )
    stream = rows.iter_rows()
    found = [next(stream)]
    victim = int(next(tmp_path.glob("*.pid")).stem)
    os.kill(victim, signal.SIGKILL)
    found += list(stream)
    assert len(list(tmp_path.glob("*.pid"))) >= 2, "a worker was replaced, or was the second"
    for number, row in enumerate(by_index(found)):
        assert row["index"] == number
        for name in ("png", "txt", "scene"):
            assert row[name] == expected[name][number]
        for name in ("bbox", "oriented", "categories"):
            np.testing.assert_array_equal(np.array(row[name]), np.array(expected[name][number]))


def test_parquet_is_the_same_with_one_and_two_workers(cluster: None, tmp_path: Path) -> None:
    import pyarrow.parquet

    from shipwake.ray import Simulate

    tables = []
    for workers in (1, 2):
        rows = ray.data.range(12, override_num_blocks=4).map_batches(
            Simulate, fn_constructor_kwargs={"seed": 5, "changes": CHANGES}, batch_size=3, concurrency=workers
        )
        folder = tmp_path / str(workers)
        rows.write_parquet(str(folder))
        tables.append(pyarrow.parquet.read_table(folder).sort_by("index").to_pylist())
    assert tables[0] == tables[1] and len(tables[0]) == 12


def test_a_folder_is_that_of_one_process(cluster: None, tmp_path: Path) -> None:
    from shipwake.ray import write

    data = Dataset(seed=5, count=10, changes=CHANGES)
    data.write(tmp_path / "one")
    assert write(tmp_path / "two", seed=5, count=10, changes=CHANGES, shards=3) == 10
    files = [path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file()]
    assert len(files) > 40
    for name in files:
        assert (tmp_path / "two" / name).read_bytes() == (tmp_path / "one" / name).read_bytes(), name


def test_a_folder_of_scenes_is_searched(cluster: None, tmp_path: Path) -> None:
    from shipwake import Detector
    from shipwake.ray import Detect

    pytest.importorskip("PIL", reason="pillow is not installed: Detect is not tested")
    data = Dataset("detector", seed=2, count=4, changes={"scene.grid.rows": 128, "scene.grid.columns": 128})
    data.write(tmp_path / "set")
    (tmp_path / "set" / "images" / "broken.png").write_bytes(b"no image")
    files = ray.data.read_binary_files(str(tmp_path / "set" / "images"), include_paths=True)
    rows = files.map_batches(
        Detect, fn_constructor_kwargs={"least_score": 0.01}, batch_size=2, concurrency=2
    ).take_all()
    assert len(rows) == 5
    for row in rows:
        if row["path"].endswith("broken.png"):
            assert row["error"] and len(row["wakes"]) == 0
            continue
        index = int(Path(row["path"]).stem)
        levels = np.floor(255 * data[index]["image"][0] + 0.5)
        expected = Detector.pretrained().find(levels, least_score=0.01, threads=1)
        assert not row["error"] and [w["score"] for w in row["wakes"]] == [w.score for w in expected]
