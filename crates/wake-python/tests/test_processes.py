"""After fork and spawn, with the pools of the parent in use: the same images, and no hang."""

from __future__ import annotations

import multiprocessing
import os
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import shipwake
from shipwake import Dataset, Scene, simulate

WAIT = 120
"""Seconds that a child may take; a hang is a failure."""


def image(scene: Scene) -> npt.NDArray[np.float32]:
    return simulate(scene, threads=2).speckled


def pixels(data: Dataset) -> npt.NDArray[np.float32]:
    return np.stack([one["image"] for one in data])


def found(levels: npt.NDArray[np.uint8]) -> list[float]:
    return [one.score for one in shipwake.Detector.pretrained().find(levels, least_score=0.03)]


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_children_make_the_same_images(method: Any, scene: Scene, data: Dataset) -> None:
    expected = image(scene), pixels(data)
    with multiprocessing.get_context(method).Pool(2) as pool:
        images = [pool.apply_async(image, (scene,)) for _ in range(4)]
        sets = pool.apply_async(pixels, (data,))
        for one in images:
            np.testing.assert_array_equal(one.get(WAIT), expected[0])
        np.testing.assert_array_equal(sets.get(WAIT), expected[1])


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_networks_work_in_children(method: Any, scene: Scene) -> None:
    levels = simulate(scene.with_values({"grid.rows": 128, "grid.columns": 128})).levels()
    expected = found(levels)
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply_async(found, (levels,)).get(WAIT) == expected


def test_a_fork_while_another_thread_simulates(scene: Scene) -> None:
    """A child that is made in the middle of a simulation of its parent finds no lock taken."""
    import threading

    large = scene.with_values({"grid.rows": 512, "grid.columns": 512})
    thread = threading.Thread(target=simulate, args=(large,), kwargs={"threads": 2})
    thread.start()
    context = multiprocessing.get_context("fork")
    with context.Pool(1) as pool:
        np.testing.assert_array_equal(pool.apply_async(image, (scene,)).get(WAIT), image(scene))
    thread.join()


def test_a_child_may_drop_what_it_inherits(scene: Scene) -> None:
    simulate(scene, threads=2)
    child = os.fork()
    if child == 0:
        status = 1
        try:
            simulate(scene, threads=2)
            status = 0
        finally:
            os._exit(status)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0
