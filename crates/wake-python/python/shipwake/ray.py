"""Data sets and searches on a cluster of Ray.

Each row is a function of recipe, seed and its number alone, so the number of workers, restarts and retries change no byte.

Needs the package ``ray[data]``. Run one thread an actor, as here, and as many actors as cores::

    import ray
    from shipwake.ray import Simulate

    rows = ray.data.range(100_000).map_batches(
        Simulate, fn_constructor_kwargs={"recipe": "detector", "seed": 7}, batch_size=16, concurrency=64
    )
    rows.write_parquet("s3://bucket/wakes")  # or rows.write_webdataset(...)
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _check
from .dataset import Dataset, merge_shards, png
from .detector import Detector

__all__ = ["Detect", "Simulate", "write"]


class Simulate:
    """Turns numbers into images with labels, for :meth:`ray.data.Dataset.map_batches`.

    Columns: ``index``; ``png``, the bytes of a PNG file of 8 bits; ``txt``, the prompt; ``bbox`` (x, y, width, height),
    ``oriented`` (four corners) and ``categories`` (0 wake, 1 ship) [pixels]; ``scene``, the text of a scene file.

    Args:
        recipe: As of :class:`shipwake.Dataset`, as are ``seed`` and ``changes``.
        seed: Seed of the whole set.
        changes: Other values by keys of the recipe.
        column: The column of the batch that holds the numbers of images; ``"id"`` is that of ``ray.data.range``.
        threads: Number of threads of an actor.
    """

    def __init__(
        self,
        recipe: str | os.PathLike[str] | Mapping[str, Any] = "ranges",
        seed: int = 7,
        changes: Mapping[str, Any] | None = None,
        column: str = "id",
        threads: int = 1,
    ) -> None:
        self.dataset = Dataset(recipe, seed, 10**12, changes=changes, threads=threads)
        self.column = column

    def __call__(self, batch: Mapping[str, npt.NDArray[Any]]) -> dict[str, Any]:
        items = [self.dataset[int(index)] for index in batch[self.column]]
        edges = [item["boxes"].T for item in items]
        return {
            "index": np.array([item["index"] for item in items], dtype=np.int64),
            "png": [png(item["image"]) for item in items],
            "txt": [item["prompt"] for item in items],
            "bbox": [np.stack([x, y, right - x, below - y], axis=1).tolist() for x, y, right, below in edges],
            "oriented": [item["corners"].tolist() for item in items],
            "categories": [item["classes"].tolist() for item in items],
            "scene": [item["scene"].to_toml() for item in items],
        }


class Detect:
    """Finds the wakes of image files, for :meth:`ray.data.Dataset.map_batches` over ``ray.data.read_binary_files``.

    Adds the column ``wakes``, a list of dictionaries with ``score``, ``tip``, ``axis_deg``, ``half_angle_deg`` and
    ``length``, and ``error``, empty where the image could be read. Removes the column ``bytes``.

    Args:
        spacing: Size of a pixel [m]; without it the scale comes from the image.
        least_score: Wakes of a lower score are left out.
        threads: Number of threads of an actor.
    """

    def __init__(
        self, spacing: float | None = None, least_score: float = Detector.OPERATING_POINT, threads: int = 1
    ) -> None:
        self.detector = Detector.pretrained()
        self.spacing, self.least_score, self.threads = spacing, least_score, threads

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        found = [self._of(content) for content in batch["bytes"]]
        rest = {name: values for name, values in batch.items() if name != "bytes"}
        return {**rest, "wakes": [wakes for wakes, _ in found], "error": [error for _, error in found]}

    def _of(self, content: bytes) -> tuple[list[dict[str, Any]], str]:
        import io

        from PIL import Image

        try:
            image = np.asarray(Image.open(io.BytesIO(content)).convert("F"))
        except Exception as error:  # noqa: BLE001 - whatever a decoder raises, the other images are searched
            return [], str(error)
        wakes = self.detector.find(
            image, spacing=self.spacing, least_score=self.least_score, threads=self.threads
        )
        names = ("score", "tip", "axis_deg", "half_angle_deg", "length")
        return [{name: getattr(wake, name) for name in names} for wake in wakes], ""


def write(
    folder: Any,
    recipe: str | os.PathLike[str] | Mapping[str, Any] = "ranges",
    seed: int = 7,
    count: int = 100,
    *,
    changes: Mapping[str, Any] | None = None,
    shards: int = 16,
    val_share: float = 0.1,
) -> int:
    """Writes the folder that ``wake dataset`` writes, byte for byte, by one task a shard.

    A task whose worker is lost is tried again and goes on where its shard was.

    Args:
        folder: A folder that every node can write, made if absent.
        recipe: As of :class:`shipwake.Dataset`, as are ``seed``, ``count`` and ``changes``.
        seed: Seed of the whole set.
        count: Number of images.
        changes: Other values by keys of the recipe.
        shards: Number of tasks.
        val_share: Share of the images that are for validation.

    Returns:
        Number of images of the set.
    """
    import ray

    dataset = Dataset(recipe, seed, count, changes=changes, threads=1)
    target = _check.path("folder", folder)
    shards = _check.whole("shards", shards, 1, 10**6)

    def task(number: int) -> int:
        return dataset.write(target, val_share=val_share, shard=(number, shards), threads=1)

    remote = ray.remote(num_cpus=1, max_retries=5)(task)
    tasks: Iterable[Any] = [remote.remote(number) for number in range(shards)]
    ray.get(list(tasks))
    return merge_shards(target)
