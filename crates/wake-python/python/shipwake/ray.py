"""Data sets and searches on a Ray cluster.

A row depends only on the data set and its index, so its bytes do not change with the number of workers, restarts or retries.

Needs the package ``ray[data]``::

    import ray
    import shipwake
    from shipwake.ray import Simulate, sample

    data = shipwake.Dataset("detector", seed=7, count=100_000)
    pool = ray.data.ActorPoolStrategy(size=64)
    rows = ray.data.range(len(data)).map_batches(Simulate, fn_constructor_args=[data], batch_size=16, compute=pool)
    rows.write_parquet("s3://bucket/wakes")
    rows.write_webdataset("s3://bucket/wakes", encoder=sample)

Ray reserves a core for each worker of a pool; leave one more for later stages such as writing, or pass ``Simulate(data)``, which
Ray runs as tasks without a pool. Ray chooses the order of rows and their files; :func:`write` makes the folder of
``wake dataset`` byte for byte.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _check
from .dataset import Dataset, merge_shards
from .detector import LEAST_SCORE, Detector, lowest, pixel_size, sea_from
from .errors import ShipwakeError
from .product import Product

if TYPE_CHECKING:
    import pyarrow

__all__ = ["Detect", "Simulate", "sample", "write"]


class Simulate:
    """Turns image indices into images with labels, for :meth:`ray.data.Dataset.map_batches`.

    Columns of the table: ``index``; ``png``, the bytes of an 8-bit PNG file; ``txt``, the prompt; ``json``, the line of
    ``metadata.jsonl`` of ``wake dataset`` with all values and labels; and from its labels ``bbox`` (x, y, width, height),
    ``oriented`` (four corners) and ``categories`` (0 wake, 1 ship) [pixels].

    Args:
        dataset: The data set.
        column: Column of the batch with the image indices; ``ray.data.range`` names it ``"id"``.
        threads: Number of threads of a worker.
    """

    def __init__(self, dataset: Dataset, column: str = "id", threads: int = 1) -> None:
        self._dataset = _dataset(dataset, threads)
        self._column = _check.text("column", column)

    def __call__(self, batch: Mapping[str, Any]) -> pyarrow.Table:
        import pyarrow as pa

        numbers = pa.list_(pa.float64())
        schema = pa.schema(
            {
                "index": pa.int64(),
                "png": pa.binary(),
                "txt": pa.string(),
                "json": pa.string(),
                "bbox": pa.list_(numbers),
                "oriented": pa.list_(pa.list_(numbers)),
                "categories": pa.list_(pa.int64()),
            }
        )
        rows = []
        for index in map(int, batch[self._column]):
            files = self._dataset.files(index)
            objects = json.loads(files["json"])["objects"]
            rows.append({"index": index, **files, **objects})
        return pa.Table.from_pylist(rows, schema=schema)


def sample(row: Mapping[str, Any]) -> dict[str, Any]:
    """Turns a row of :class:`Simulate` into the three files that ``wake dataset --webdataset`` writes.

    Pass it as ``encoder`` to :meth:`ray.data.Dataset.write_webdataset`.
    """
    files = {ending: row[ending] for ending in ("json", "png", "txt")}
    return {"__key__": f"{row['index']:06d}", **files}


class Detect:
    """Finds the wakes in satellite products and image files, for :meth:`ray.data.Dataset.map_batches`.

    ::

        scenes = ray.data.from_items([{"path": str(path)} for path in sorted(folder.glob("*.SAFE"))])
        pool = ray.data.ActorPoolStrategy(size=2)
        found = scenes.map_batches(Detect, fn_constructor_kwargs={"coast": 2000}, batch_size=1, compute=pool)
        found.write_parquet("s3://bucket/found")

    Columns of the table: ``path``; ``wakes``, the list that :meth:`shipwake.Detector.find_in` returns; and ``error``, why the
    file could not be searched, or empty text.

    Args:
        spacing: Pixel size [m], as in :meth:`shipwake.Detector.find_in`.
        least_score: Lowest score of the reported wakes.
        coast: Distance from land within which sea is not searched [m]; ``None`` searches land, too.
        weights: File of weights that every worker can read; by default the weights of the package.
        column: Column of the batch with the paths.
        threads: Number of threads of a worker.
    """

    def __init__(
        self,
        spacing: float | None = None,
        least_score: float = LEAST_SCORE,
        coast: float | None = 1000.0,
        weights: str | os.PathLike[str] | None = None,
        column: str = "path",
        threads: int = 1,
    ) -> None:
        self._detector = Detector.pretrained() if weights is None else Detector.load(weights)
        self._options: dict[str, Any] = {
            "spacing": pixel_size(spacing),
            "least_score": lowest(least_score),
            "coast": sea_from(coast),
            "threads": _check.threads(threads),
        }
        self._column = _check.text("column", column)

    def __call__(self, batch: Mapping[str, Any]) -> pyarrow.Table:
        import pyarrow as pa

        pair = pa.list_(pa.float64())
        numbers = dict.fromkeys(("score", "probability", "direction_probability"), pa.float64())
        numbers |= {"sure": pa.bool_(), "line": pa.float64(), "pixel": pa.float64(), "tip": pair, "end": pair}
        numbers |= dict.fromkeys(("heading", "length", "length_deviation"), pa.float64())
        numbers |= {"end_px": pair, "length_px": pa.float64(), "half_angle": pa.float64(), "contrast_db": pa.float64()}
        numbers |= {"kind": pa.string(), "incidence": pa.float64(), "time": pa.string()}
        echo = ["line", "pixel", "latitude", "longitude", "displacement", "radial_velocity", "radial_velocity_deviation"]
        numbers["echo"] = pa.struct(dict.fromkeys(echo, pa.float64()))
        schema = pa.schema({"path": pa.string(), "wakes": pa.list_(pa.struct(numbers)), "error": pa.string()})
        rows = [self._found(str(path)) for path in batch[self._column]]
        return pa.Table.from_pylist(rows, schema=schema)

    def _found(self, path: str) -> dict[str, Any]:
        try:
            wakes = self._detector.find_in(Product.open(path), **self._options)
        except ShipwakeError as error:
            return {"path": path, "wakes": [], "error": str(error)}
        return {"path": path, "wakes": wakes, "error": ""}


def write(dataset: Dataset, folder: Any, *, shards: int = 16, val_share: float = 0.1) -> int:
    """Writes the same folder as :meth:`shipwake.Dataset.write`, byte for byte, with one task per shard.

    A task whose worker is lost is retried up to five times, and resumes its shard.

    Args:
        dataset: The data set.
        folder: A folder that every node can write to, made if absent.
        shards: Number of tasks, each on one core.
        val_share: Share of the images for validation, 0 to 1.

    Returns:
        Number of images in the data set.

    Raises:
        DatasetError: A folder that holds something else, or a damaged file.
        FileError: A folder that cannot be written.
    """
    import ray

    one = _dataset(dataset, 1)
    target = os.path.abspath(_check.path("folder", folder))
    shards = _check.whole("shards", shards, 1, 10**6)

    def shipwake_shard(number: int) -> int:
        return one.write(target, val_share=val_share, shard=(number, shards), threads=1)

    task = ray.remote(num_cpus=1, max_retries=5)(shipwake_shard)
    try:
        ray.get([task.remote(number) for number in range(shards)])
    except ray.exceptions.RayTaskError as error:
        raise error.cause if isinstance(error.cause, ShipwakeError) else error from None
    return merge_shards(target)


def _dataset(dataset: Dataset, threads: int) -> Dataset:
    if not isinstance(dataset, Dataset):
        raise TypeError(f"dataset is {dataset!r:.80}, expected a Dataset")
    return dataset._on(_check.whole("threads", threads, 1, 1024))
