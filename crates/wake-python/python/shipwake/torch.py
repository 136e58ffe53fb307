"""Batches as torch tensors, and an iterable data set that gives the same batches with any number of workers.

Needs the package ``torch``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypedDict

import torch
from torch.utils.data import IterableDataset, get_worker_info

from . import _check
from .dataset import Batch, Dataset, Item
from .labels import Labels
from .scene import Scene

__all__ = ["Batches", "TensorBatch", "collate"]


class TensorBatch(TypedDict):
    """Several images as tensors, see :class:`shipwake.dataset.Item`."""

    index: torch.Tensor
    """``[images]``, whole numbers."""
    image: torch.Tensor
    """``[images, 1, rows, columns]``: grey, 0 to 1."""
    prompt: list[str]
    boxes: list[torch.Tensor]
    corners: list[torch.Tensor]
    classes: list[torch.Tensor]
    labels: list[Labels]
    scene: list[Scene]


def collate(items: Sequence[Item]) -> TensorBatch:
    """Collates items into tensors: ``collate_fn`` of a :class:`torch.utils.data.DataLoader` over a :class:`shipwake.Dataset`."""
    return {
        "index": torch.tensor([one["index"] for one in items]),
        "image": torch.stack([torch.from_numpy(one["image"]) for one in items]),
        "prompt": [one["prompt"] for one in items],
        "boxes": [torch.from_numpy(one["boxes"]) for one in items],
        "corners": [torch.from_numpy(one["corners"]) for one in items],
        "classes": [torch.from_numpy(one["classes"]) for one in items],
        "labels": [one["labels"] for one in items],
        "scene": [one["scene"] for one in items],
    }


class Batches(IterableDataset[TensorBatch]):
    """Batches of a data set in order, for ``DataLoader(Batches(data, 16), batch_size=None, num_workers=2)``.

    Worker k of n makes batches k, k + n, k + 2n, …, and the loader takes batches from the workers in turn, so they keep the order
    of the data set with any number of workers.

    Args:
        dataset: The data set.
        size: Images per batch.
        start: Number of the first batch, to resume a run that was stopped.
    """

    def __init__(self, dataset: Dataset, size: int, start: int = 0) -> None:
        super().__init__()
        self.dataset = dataset
        self.size = _check.whole("size", size, 1, 10**6)
        self.start = _check.whole("start", start, 0, 10**12)

    def __len__(self) -> int:
        return max(0, -(-len(self.dataset) // self.size) - self.start)

    def __iter__(self) -> Iterator[TensorBatch]:
        worker: Any = get_worker_info()
        number, of = (0, 1) if worker is None else (worker.id, worker.num_workers)
        steps = range(self.start + number, -(-len(self.dataset) // self.size), of)
        return (_tensors(self.dataset.batch(step, self.size)) for step in steps)


def _tensors(batch: Batch) -> TensorBatch:
    return {
        "index": torch.from_numpy(batch["index"]),
        "image": torch.from_numpy(batch["image"]),
        "prompt": batch["prompt"],
        "boxes": [torch.from_numpy(one) for one in batch["boxes"]],
        "corners": [torch.from_numpy(one) for one in batch["corners"]],
        "classes": [torch.from_numpy(one) for one in batch["classes"]],
        "labels": batch["labels"],
        "scene": batch["scene"],
    }
