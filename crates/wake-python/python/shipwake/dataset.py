"""Data sets of simulated images with labels: by index, in batches, and as folders."""

from __future__ import annotations

import operator
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .errors import FileError, OptionError
from .labels import Labels
from .scene import Scene

if TYPE_CHECKING:
    import datasets

__all__ = ["CLASSES", "Batch", "Dataset", "Item", "merge_shards"]

CLASSES = ("wake", "ship")
"""Names of the classes 0 and 1."""

_LONGEST_RECIPE = 1 << 20


class Item(TypedDict):
    """One image of a data set, with its labels and scene.

    Boxes count from the corner of the first pixel, as in COCO and YOLO files.
    """

    index: int
    """Number of the image in the data set."""
    image: npt.NDArray[np.float32]
    """``[1, rows, columns]``: grey, 0 to 1."""
    prompt: str
    """The scene in words."""
    boxes: npt.NDArray[np.float32]
    """``[objects, 4]``: left, top, right and bottom [pixels], cut to the image."""
    corners: npt.NDArray[np.float32]
    """``[objects, 4, 2]``: corners (x, y) of the boxes along the track [pixels]; may lie outside the image."""
    classes: npt.NDArray[np.int64]
    """``[objects]``: 0 for a wake, 1 for a ship."""
    labels: Labels
    """All labels. Their pixels count from the centre of the first pixel, half a pixel from the origin of the boxes."""
    scene: Scene
    """The scene that made the image."""
    amplitudes: tuple[float, float] | None
    """Amplitudes of grey 0 and grey 1, for recipes with quick-looks; else ``None``."""


class Batch(TypedDict):
    """Several images of a data set, see :class:`Item`."""

    index: npt.NDArray[np.int64]
    """``[images]``: numbers of the images."""
    image: npt.NDArray[np.float32]
    """``[images, 1, rows, columns]``: grey, 0 to 1."""
    prompt: list[str]
    boxes: list[npt.NDArray[np.float32]]
    corners: list[npt.NDArray[np.float32]]
    classes: list[npt.NDArray[np.int64]]
    labels: list[Labels]
    scene: list[Scene]
    amplitudes: list[tuple[float, float] | None]


class Dataset:
    """Simulated images with labels: a map-style data set for torch, which can also be written to a folder.

    Image i depends only on recipe, seed and i, not on the number of workers, threads or machines.

    >>> from shipwake import Dataset
    >>> data = Dataset("ranges", seed=7, count=10, changes={"scene.grid.rows": 32, "scene.grid.columns": 32})
    >>> len(data), data[3]["image"].shape
    (10, (1, 32, 32))
    >>> next(data.batches(4))["image"].shape
    (4, 1, 32, 32)

    With torch, any number of workers gives the same batches::

        from torch.utils.data import DataLoader
        from shipwake.torch import collate

        loader = DataLoader(data, batch_size=16, num_workers=2, collate_fn=collate)

    Args:
        recipe: ``"paper"``, ``"ranges"``, ``"detector"`` or ``"model"``, the path of a recipe file, or its tables as a
            dictionary.
        seed: Seed of the data set, 0 to 2**64 - 1.
        count: Number of images; by default 100, and 3456 for the recipe ``"paper"``.
        changes: Values that replace those of the recipe, by key, such as ``{"scene.grid.rows": 128, "speckle": True}``.
        threads: Number of threads that make an image or a batch; by default one per core, and one in a worker of torch.

    Raises:
        RecipeError: An invalid recipe.
        SceneError: A value out of its range.
        FileError: A recipe file that cannot be read.
    """

    __slots__ = ("_arguments", "_inner", "_count", "_threads")

    _inner: _core.Simulated
    _arguments: tuple[Any, ...]
    _count: int
    _threads: int | None

    def __init__(
        self,
        recipe: str | os.PathLike[str] | Mapping[str, Any] = "ranges",
        seed: int = 7,
        count: int | None = None,
        *,
        changes: Mapping[str, Any] | None = None,
        threads: int | None = None,
    ) -> None:
        seed = _check.whole("seed", seed, 0, _check.LARGEST_SEED)
        if count is None:
            count = 3456 if isinstance(recipe, str) and recipe == "paper" else 100
        self._count = _check.whole("count", count, 1, 10**12)
        self._threads = _check.threads(threads)
        values = dict(changes or {})
        source: str | _Text | dict[str, Any]
        if isinstance(recipe, Mapping):
            source = dict(recipe)
        elif isinstance(recipe, str) and not recipe.endswith(".toml"):
            source = recipe
        else:
            source = _Text(_read(_check.path("recipe", recipe)))
        self._arguments = (source, seed, self._count, values, self._threads)
        self._inner = _simulated(source, values, seed)

    @property
    def recipe(self) -> str:
        """The whole recipe, as the text of a recipe file."""
        return self._inner.to_toml()

    @property
    def seed(self) -> int:
        """Seed of the data set."""
        return self._inner.seed()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of every image."""
        return self._inner.size()

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Item:
        """Returns image number ``index`` with its labels; negative numbers count from the end."""
        return _item(self._inner.pair(self._position(index), self._pool()))

    def __iter__(self) -> Iterator[Item]:
        return (self[index] for index in range(self._count))

    def scene(self, index: int) -> Scene:
        """Returns the scene of image number ``index`` without simulating the image."""
        return Scene._of(self._inner.scene(self._position(index)))

    def without_image(self, index: int) -> Item:
        """Returns ``dataset[index]`` without simulating the image, which has no pixels."""
        return _item(self._inner.without_image(self._position(index)))

    def files(self, index: int) -> dict[str, bytes]:
        """Returns image number ``index`` as the files of a WebDataset sample, as in ``wake dataset --webdataset``.

        ``png`` is the 8-bit image, ``txt`` the prompt, ``json`` the line of ``metadata.jsonl``: labels, values, scene.
        """
        return self._inner.files(self._position(index), self._pool())

    def batches(self, size: int, *, start: int = 0) -> Iterator[Batch]:
        """Yields the images in order, ``size`` at a time; the last batch may be smaller.

        Args:
            size: Images per batch.
            start: Number of the first batch, to resume a run that was stopped.
        """
        size = _check.whole("size", size, 1, 10**6)
        start = _check.whole("start", start, 0, 10**12)
        return (self.batch(step, size) for step in range(start, -(-self._count // size)))

    def batch(self, step: int, size: int) -> Batch:
        """Returns batch number ``step`` of ``size`` images."""
        first = _check.whole("step", step, 0, 10**12) * _check.whole("size", size, 1, 10**6)
        if first >= self._count:
            raise IndexError(f"batch {step} of {size} images begins after the last of {self._count} images")
        images, items = self._inner.pairs(first, min(first + size, self._count), self._pool())
        return {
            "index": np.array([one["index"] for one in items], dtype=np.int64),
            "image": images,
            "prompt": [one["prompt"] for one in items],
            "boxes": [one["boxes"] for one in items],
            "corners": [one["corners"] for one in items],
            "classes": [one["classes"] for one in items],
            "labels": [Labels._of(one["labels"]) for one in items],
            "scene": [Scene._of(one["scene"]) for one in items],
            "amplitudes": [one["amplitudes"] for one in items],
        }

    def write(
        self,
        folder: Any,
        *,
        val_share: float = 0.1,
        shard: tuple[int, int] | None = None,
        threads: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> int:
        """Writes the data set into a folder as ``wake dataset`` does: PNG, YOLO, YOLO-OBB, DOTA, COCO, and prompts.

        A call after a run that was stopped resumes it. The bytes depend only on recipe, seed, count and ``val_share``.

        Args:
            folder: The folder, made if absent; a shard is written to ``folder/shard-i``, see :func:`merge_shards`.
            val_share: Share of the images for validation, 0 to 1.
            shard: ``(i, n)`` writes share i of n, counted from 0.
            threads: Number of images made at the same time, by default one per core.
            progress: Called as ``progress(done, total)``.

        Returns:
            Number of images made by this call.

        Raises:
            DatasetError: A folder that holds something else, or a damaged file.
            FileError: A folder that cannot be written.
        """
        target = _check.path("folder", folder)
        if shard is not None:
            number, of = _shard(shard)
            shard = (number, of)
            target = os.path.join(target, f"shard-{number}")
        return self._inner.write(
            target,
            self._count,
            _check.number("val_share", val_share, 0.0, 1.0),
            shard,
            self._threads if threads is None else _check.threads(threads),
            progress,
        )

    def to_hf(self) -> datasets.Dataset:
        """Returns the data set as a :class:`datasets.Dataset` in memory.

        Its columns are ``image``, ``text``, ``objects`` and ``scene``. Needs the package ``datasets``. For data sets that do not
        fit in memory use :meth:`write` and ``datasets.load_dataset("imagefolder", data_dir=folder)``.
        """
        import datasets

        boxes = datasets.Sequence(datasets.Sequence(datasets.Value("float32"), length=4))
        corners = datasets.Sequence(datasets.Sequence(datasets.Sequence(datasets.Value("float32"), length=2), length=4))
        features = datasets.Features(
            {
                "image": datasets.Image(),
                "text": datasets.Value("string"),
                "objects": {
                    "bbox": boxes,
                    "oriented": corners,
                    "categories": datasets.Sequence(datasets.ClassLabel(names=list(CLASSES))),
                },
                "scene": datasets.Value("string"),
            }
        )
        rows: dict[str, list[Any]] = {name: [] for name in features}
        for item in self:
            left, top, right, bottom = item["boxes"].T
            rows["image"].append({"bytes": png(item["image"]), "path": None})
            rows["text"].append(item["prompt"])
            rows["objects"].append(
                {
                    "bbox": np.stack([left, top, right - left, bottom - top], axis=1).tolist(),
                    "oriented": item["corners"].tolist(),
                    "categories": item["classes"].tolist(),
                }
            )
            rows["scene"].append(item["scene"].to_toml())
        return datasets.Dataset.from_dict(rows, features=features)

    def _position(self, index: int) -> int:
        position = operator.index(index)
        if not -self._count <= position < self._count:
            raise IndexError(f"image {position} is outside the data set of {self._count} images")
        return position % self._count

    def _pool(self) -> int | None:
        if self._threads is None and _is_worker():
            return 1
        return self._threads

    def _on(self, threads: int) -> Dataset:
        """Returns the same data set, made by ``threads`` threads."""
        source, seed, count, values, _ = self._arguments
        return _again(source, seed, count, values, threads)

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, self._arguments

    def __repr__(self) -> str:
        rows, columns = self.shape
        return f"<Dataset of {self._count} images of {rows} x {columns} pixels, seed {self.seed}>"


def merge_shards(folder: Any) -> int:
    """Joins the shards of a folder into the data set that one run would have written, byte for byte.

    Returns:
        Number of images.

    Raises:
        DatasetError: A shard that is missing, unfinished, or of another data set.
    """
    return _core.merge_shards(_check.path("folder", folder))


def png(image: npt.NDArray[np.float32]) -> bytes:
    """Encodes an image of grey 0 to 1 as the bytes of an 8-bit PNG file."""
    grey = np.asarray(image, dtype=np.float32).reshape(image.shape[-2:])
    return _core.png(np.floor(255.0 * grey + 0.5).astype(np.uint8))


class _Text(str):
    """Text of a recipe file, to tell it from the name of a recipe."""


def _again(
    source: str | dict[str, Any], seed: int, count: int, values: dict[str, Any], threads: int | None
) -> Dataset:
    """Restores a data set in another process, without its recipe file."""
    dataset = Dataset.__new__(Dataset)
    dataset._arguments = (source, seed, count, values, threads)
    dataset._inner, dataset._count, dataset._threads = _simulated(source, values, seed), count, threads
    return dataset


def _simulated(source: str | dict[str, Any], values: dict[str, Any], seed: int) -> _core.Simulated:
    if isinstance(source, dict):
        return _core.Simulated.from_tables(source, values, seed)
    if isinstance(source, _Text):
        return _core.Simulated.from_toml(source, values, seed)
    return _core.Simulated.named(_check.text("recipe", source), values, seed)


def _item(one: dict[str, Any]) -> Item:
    return {
        "index": one["index"],
        "image": one["image"][np.newaxis],
        "prompt": one["prompt"],
        "boxes": one["boxes"],
        "corners": one["corners"],
        "classes": one["classes"],
        "labels": Labels._of(one["labels"]),
        "scene": Scene._of(one["scene"]),
        "amplitudes": one["amplitudes"],
    }


def _read(path: str) -> str:
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read(_LONGEST_RECIPE + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"cannot read {path}: {error}") from error
    if len(text) > _LONGEST_RECIPE:
        raise FileError(f"cannot read {path}: it is longer than 1 MiB, the limit for a recipe")
    return text


def _shard(shard: Any) -> tuple[int, int]:
    try:
        number, of = shard
    except (TypeError, ValueError):
        raise OptionError(f"shard is {shard!r:.80}, expected (i, n), such as (0, 4)") from None
    of = _check.whole("the number of shards", of, 1, 10**6)
    return _check.whole("shard", number, 0, of - 1), of


def _is_worker() -> bool:
    """Whether this process is a worker of torch's loader, of which there is usually one per core."""
    data = sys.modules.get("torch.utils.data")
    return data is not None and data.get_worker_info() is not None
