"""Small scenes, and products made on the spot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import shipwake

SMALL: dict[str, Any] = {"rows": 48, "columns": 40, "spacing": 5.0}


@pytest.fixture
def scene() -> shipwake.Scene:
    """A small scene with a ship."""
    return shipwake.Scene(ship={"speed": 8, "length": 60, "beam": 10, "draft": 4}, sea={"wind_speed": 3}, grid=SMALL)


@pytest.fixture
def data() -> shipwake.Dataset:
    """Six small images."""
    return shipwake.Dataset(
        seed=3,
        count=6,
        changes={"scene.grid.rows": 32, "scene.grid.columns": 24, "scene.grid.spacing": 20, "draw.count": 1, "speckle": True},
    )


@pytest.fixture(scope="session")
def products() -> Path:
    """The folder of the test products of the Rust crates."""
    return Path(__file__).parents[2] / "wake-geo" / "tests" / "fixtures"
