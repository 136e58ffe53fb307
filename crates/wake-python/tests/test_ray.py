"""A local cluster of Ray with two workers, of which one is killed in the middle: the same bytes as one process makes."""

from __future__ import annotations

import os
import signal
import tarfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shipwake import Dataset, Detector, Product, errors

ray = pytest.importorskip("ray", reason="ray is not installed: shipwake.ray is NOT tested")
pytest.importorskip("ray.data", reason="ray[data] is not installed: shipwake.ray is NOT tested")
import pyarrow.parquet  # noqa: E402

from shipwake.ray import Detect, Simulate, sample, write  # noqa: E402

WAIT = 120
"""Seconds until something that never happens is a failure."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    # Workers of Ray give way to all else that the machine does, unless told otherwise.
    options = {"worker_niceness": 0}
    ray.init(num_cpus=3, include_dashboard=False, log_to_driver=False, object_store_memory=2 * 10**8, _system_config=options)
    ray.data.DataContext.get_current().enable_progress_bars = False
    yield
    ray.shutdown()


@pytest.fixture
def many() -> Dataset:
    """Forty images of 10 ms each."""
    return Dataset(seed=5, count=40, changes={"scene.grid.rows": 96, "scene.grid.columns": 96, "draw.count": 1})


def pool(size: int) -> Any:
    return ray.data.ActorPoolStrategy(size=size)


def processes(title: str) -> list[int]:
    """Processes that call themselves so, as workers of Ray do while they work."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name = (folder / "cmdline").read_bytes()
        except OSError:
            continue
        if name.startswith(title.encode()):
            found.append(int(folder.name))
    return found


def kill_one(title: str, in_the_middle: Callable[[], bool]) -> Callable[[], int]:
    """Kills a process of that title once ``in_the_middle`` holds; the result tells which, and fails where none was."""
    import threading

    killed: list[int] = []

    def watch() -> None:
        end = time.monotonic() + WAIT
        while not killed and time.monotonic() < end:
            if in_the_middle():
                for process in processes(title)[:1]:
                    os.kill(process, signal.SIGKILL)
                    killed.append(process)
            time.sleep(0.002)

    thread = threading.Thread(target=watch)
    thread.start()

    def result() -> int:
        thread.join()
        assert killed, "no worker was killed"
        return killed[0]

    return result


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def expect(rows: list[dict[str, Any]], data: Dataset) -> None:
    assert sorted(row["index"] for row in rows) == list(range(len(data)))
    for row in rows:
        made, item = data.files(row["index"]), data.without_image(row["index"])
        assert (row["png"], row["txt"].encode(), row["json"].encode()) == (made["png"], made["txt"], made["json"])
        assert row["categories"] == item["classes"].tolist()
        assert len(row["bbox"]) == len(row["oriented"]) == len(row["categories"])


def table(folder: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pyarrow.parquet.read_table(folder).to_pylist()
    return rows


def test_a_killed_worker_changes_no_byte(cluster: None, many: Dataset, tmp_path: Path) -> None:
    """One of two workers with state of their own dies while the other one works."""

    class Slow(Simulate):
        """Says that it works, and leaves time to kill it."""

        def __call__(self, batch: Any) -> Any:
            (tmp_path / f"{os.getpid()}.pid").touch()
            time.sleep(0.2)
            return super().__call__(batch)

    def workers() -> list[int]:
        return [int(path.stem) for path in tmp_path.glob("*.pid")]

    rows = ray.data.range(len(many), override_num_blocks=10).map_batches(
        Slow, fn_constructor_args=[many], batch_size=4, compute=pool(2)
    )
    killed = kill_one("ray::MapWorker", lambda: len(workers()) == 2)
    rows.write_parquet(str(tmp_path / "rows"))
    victim = killed()
    assert victim in workers() and len(workers()) == 3, "a third one takes the place of the victim"
    expect(table(tmp_path / "rows"), many)


@pytest.mark.parametrize("workers", [1, 2])
def test_parquet_holds_the_images_whatever_the_workers(cluster: None, many: Dataset, tmp_path: Path, workers: int) -> None:
    numbers = ray.data.range(len(many), override_num_blocks=4)
    numbers.map_batches(Simulate, fn_constructor_args=[many], batch_size=3, compute=pool(workers)).write_parquet(
        str(tmp_path / "actors")
    )
    numbers.map_batches(Simulate(many), batch_size=7).write_parquet(str(tmp_path / "tasks"))
    for name in ("actors", "tasks"):
        expect(table(tmp_path / name), many)


def test_shards_hold_the_samples_of_the_program(cluster: None, many: Dataset, tmp_path: Path) -> None:
    rows = ray.data.range(len(many), override_num_blocks=4).map_batches(Simulate(many), batch_size=5)
    rows.write_webdataset(str(tmp_path), encoder=sample)
    found: dict[str, bytes] = {}
    for path in tmp_path.glob("*.tar"):
        with tarfile.open(path) as archive:
            for member in archive:
                content = archive.extractfile(member)
                assert content is not None and member.name not in found
                found[member.name] = content.read()
    expected = {f"{index:06d}.{ending}": content for index in range(len(many)) for ending, content in many.files(index).items()}
    assert found == expected


def test_a_folder_is_that_of_one_process(cluster: None, many: Dataset, tmp_path: Path) -> None:
    """A worker dies while its shard is half written; its task goes on where the shard was."""
    many.write(tmp_path / "one")
    begun = tmp_path / "two" / "shard-0" / "images"
    killed = kill_one("ray::shipwake_shard", lambda: begun.exists() and len(list(begun.iterdir())) > 2)
    assert write(many, tmp_path / "two", shards=2) == len(many)
    killed()
    one, two = files(tmp_path / "one"), files(tmp_path / "two")
    assert one == {name: content for name, content in two.items() if name in one} and len(one) > 4 * len(many)


def test_a_folder_of_scenes_is_searched(cluster: None, products: Path, tmp_path: Path) -> None:
    from shipwake.dataset import png

    data = Dataset("detector", seed=2, count=4, changes={"scene.grid.rows": 128, "scene.grid.columns": 128})
    for index, item in enumerate(data):
        (tmp_path / f"{index}.png").write_bytes(png(item["image"]))
    (tmp_path / "broken.png").write_bytes(b"no image")
    scenes = [{"path": str(path)} for path in sorted(tmp_path.iterdir())]
    found = {}
    for workers in (1, 2):
        rows = ray.data.from_items(scenes).map_batches(
            Detect, fn_constructor_kwargs={"spacing": 10.0, "least_score": 0.0}, batch_size=1, compute=pool(workers)
        )
        found[workers] = sorted(rows.take_all(), key=lambda row: str(row["path"]))
    assert repr(found[1]) == repr(found[2]) and len(found[1]) == 5
    detector, wakes = Detector.pretrained(), 0
    for row in found[1]:
        if row["path"].endswith("broken.png"):
            assert "broken.png" in row["error"] and len(row["wakes"]) == 0
            continue
        expected = detector.find_in(Product.open(row["path"]), spacing=10.0, least_score=0.0, threads=1)
        assert not row["error"] and len(row["wakes"]) == len(expected)
        for one, other in zip(row["wakes"], expected, strict=True):
            assert one == {key: other[key] for key in one}
        wakes += len(expected)
    assert wakes > 0


def test_products_are_searched(products: Path, tmp_path: Path) -> None:
    """Without a cluster: a dark line along a parallel is found on the map, and a product without pixels is told."""
    tiff = pytest.importorskip("PIL.TiffImagePlugin", reason="pillow is not installed: products are not searched")
    from PIL import Image

    degrees, west, north = 10 / 111_195, -20.0, 5.0  # pixels of 10 m
    amplitudes = 60 * np.sqrt(np.random.default_rng(3).gamma(4.0, 0.25, size=(256, 256)))
    amplitudes[128:132, 20:230] *= 0.6
    tags = tiff.ImageFileDirectory_v2()
    tags[33550], tags[33922] = (degrees, degrees, 0.0), (0.0, 0.0, 0.0, west, north, 0.0)
    tags.tagtype[33550] = tags.tagtype[33922] = 12
    tags[34735] = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326)  # latitude, longitude; pixels are areas; WGS 84
    tags.tagtype[34735] = 3
    Image.fromarray(amplitudes.clip(0, 255).astype(np.uint8)).save(tmp_path / "line.tif", tiffinfo=tags)
    [empty] = products.glob("S1A_IW_GRDH_1SDV_2021*.zip")
    line, unread = Detect()({"path": [str(tmp_path / "line.tif"), str(empty)]}).to_pylist()
    assert unread["path"] == str(empty) and not unread["wakes"] and "pixels" in unread["error"]
    best = line["wakes"][0]
    assert line["error"] == "" and best["sure"]
    # Four rows around 129.5: the tip within the width of a box, the heading within the 30 degrees of one wake.
    assert abs(best["tip"][1] - (north - 130 * degrees)) < 8 * degrees
    assert west < best["tip"][0] < west + 256 * degrees
    assert abs((best["heading"] % 180) - 90) < 30 and best["kind"] == "dark-line" and best["contrast_db"] < 0


def test_wrong_arguments_are_refused(cluster: None, many: Dataset, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="Dataset"):
        Simulate("detector")  # type: ignore[arg-type]
    with pytest.raises(IndexError):
        Simulate(many)({"id": [len(many)]})
    for wrong in ({"threads": 0}, {"spacing": -1}, {"least_score": float("nan")}, {"coast": -3}, {"column": 3}):
        with pytest.raises(errors.OptionError):
            Detect(**wrong)  # type: ignore[arg-type]
    with pytest.raises(errors.OptionError):
        write(many, tmp_path, shards=0)
    (tmp_path / "shard-0").mkdir()
    (tmp_path / "shard-0" / "file").write_text("mine")
    with pytest.raises(errors.DatasetError, match="not empty"):
        write(many, tmp_path, shards=1)
