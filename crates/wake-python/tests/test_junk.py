"""No panic reaches Python: every public call with values that fit nothing, one argument at a time."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shipwake
from shipwake import Dataset, Detector, Product, Sampler, Scene, errors
from shipwake.ray import Detect, Simulate, sample, write
from shipwake.simulation import levels

JUNK: list[Any] = [
    None, True, -1, 0, 3, 2**63, -(2**63) - 1, 10**400, 1.5, -0.0, 1e308, float("nan"), float("inf"), 1j,
    "", "x", "\0", "\ud800", "ship.speed", "a" * 100_000, b"", b"\xff", [], [[]], [None], ["x", 3], (), {}, {"ship": {"speed": []}},
    {"": {"": None}}, {3: 4}, set(), object(), Exception, range(3), slice(None), slice(5, 2), slice(-(10**30), 10**30), lambda *_: 1 / 0,
    np.zeros(0), np.zeros((0, 0)), np.zeros((2, 0)), np.zeros((2, 2, 2)), np.full((3, 4), np.nan), np.full((3, 4), np.inf),
    np.full((3, 4), 1e300), np.zeros((3, 4), dtype=complex), np.zeros((3, 4), dtype=bool), np.array([["a", "b"]]),
    np.array([[None, object()]]), np.zeros((3, 4), dtype=[("a", "f4")]), np.array([["2020-01-01"]], dtype="M8[D]"),
    np.zeros((6, 8))[::-2, ::3], np.broadcast_to(np.float32(1), (10**6, 10**6)), np.float16(3), np.int8(-3), np.str_("x"),
]  # fmt: skip
SMALL: dict[str, Any] = {"rows": 24, "columns": 20, "spacing": 10}


def calls(folder: Path, products: Path) -> Iterator[tuple[str, Callable[..., Any], dict[str, Any]]]:
    scene = Scene(grid=SMALL)
    data = Dataset(count=2, changes={f"scene.grid.{key}": value for key, value in SMALL.items()})
    made = shipwake.simulate(scene)
    detector, sampler = Detector.pretrained(), Sampler.pretrained(steps=1)
    product = Product.open(next(products.glob("S1A_IW_GRDH_1SDV_2021*.zip")))
    raster = Product.open(next((products / "gdal").glob("*.tif")))
    image = np.ones((20, 24))
    # Functions with arguments that they take; what only they may write lies in `folder`.
    yield "Scene", Scene, {"ship": {"speed": 8}, "sea": {"wind_speed": 3}, "radar": {}, "grid": SMALL, "model": {}, "seed": 3}
    yield "Scene.from_toml", Scene.from_toml, {"text": "seed = 3"}
    yield "Scene.read", Scene.read, {"path": folder / "none.toml"}
    yield "Scene.from_prompt", Scene.from_prompt, {"prompt": "a ship at 5 m/s", "base": scene}
    yield "Scene.prompt", scene.prompt, {"wording": "brief"}
    yield "Scene.with_values", lambda values: scene.with_values(values), {"values": {"seed": 3}}
    yield "Scene.with_values, a value", lambda value: scene.with_values({"ship.speed": value}), {"value": 3}
    yield "Scene.with_values, tables", lambda ship: scene.with_values(ship=ship), {"ship": {"speed": 3}}
    yield "Scene.__getitem__", lambda key: scene[key], {"key": "seed"}
    yield "simulate", shipwake.simulate, {"scene": scene, "threads": 1}
    yield "expected_intensity", shipwake.expected_intensity, {"scene": scene, "threads": 1}
    batch = {"theta": [[3.0]], "keys": ["ship.speed"], "base": scene, "seed": 1, "first": 0, "speckle": True, "threads": 1}
    yield "simulate_batch", shipwake.simulate_batch, batch
    yield "levels", levels, {"power": image, "grey": made.grey}
    yield "Simulation.write_png", made.write_png, {"path": folder / "a.png"}
    yield "Sampler.pretrained", Sampler.pretrained, {"steps": 1, "mode": "both"}
    yield "Sampler.from_folder", Sampler.from_folder, {"folder": folder}
    yield "Sampler.sample", sampler.sample, {"prompt": "a ship at 5 m/s", "seed": 3, "threads": 1}
    yield "Detector.load", Detector.load, {"file": folder / "none"}
    found = {"image": image, "spacing": 10.0, "least_score": 0.1, "intensity": False, "threads": 1}
    yield "Detector.find", detector.find, found
    yield "Detector.find_in", detector.find_in, {"product": raster, "spacing": 10.0, "least_score": 0.1, "coast": None, "threads": 1}
    yield "Product.open", Product.open, {"path": folder / "none", "polarization": "VV"}
    yield "Product.read", raster.read, {"lines": slice(0, 3), "pixels": slice(0, 3)}
    for name, values in {
        "place": {"line": 3, "pixel": 3},
        "pixel_of": {"latitude": 0, "longitude": 0},
        "axes": {"line": 3, "pixel": 3},
        "range_to_velocity": {"line": 3, "pixel": 3},
        "locate": {"line": 3, "pixel": 3, "digital_number": 3},
    }.items():
        yield f"Product.{name}", getattr(product, name), values
        yield f"Product.{name}, a raster", getattr(raster, name), values
    yield "Dataset", Dataset, {"recipe": "ranges", "seed": 3, "count": 2, "changes": {}, "threads": 1}
    yield "Dataset, a change", lambda value: Dataset(changes={"scene.sea.wind_speed": value}), {"value": 3}
    yield "Dataset, a draw", lambda value: Dataset({"draw": {"ship.speed": value}}).scene(0), {"value": [3, 4]}
    for name in ("scene", "without_image", "files", "__getitem__"):
        yield f"Dataset.{name}", getattr(data, name), {next(iter(inspect.signature(getattr(data, name)).parameters)): 0}
    yield "Dataset.batches", lambda size, start: next(data.batches(size, start=start), None), {"size": 1, "start": 0}
    yield "Dataset.batch", data.batch, {"step": 0, "size": 1}
    writes = {"folder": folder / "set", "val_share": 0.5, "shard": None, "threads": 1, "progress": None}
    yield "Dataset.write", data.write, writes
    yield "merge_shards", shipwake.merge_shards, {"folder": folder / "none"}
    yield "ray.Simulate", Simulate, {"dataset": data, "column": "id", "threads": 1}
    yield "ray.Simulate()", Simulate(data), {"batch": {"id": []}}
    yield "ray.sample", sample, {"row": {"index": 3, "json": "", "png": b"", "txt": ""}}
    yield "ray.Detect", Detect, {"spacing": None, "least_score": 0.1, "coast": None, "weights": None, "column": "a", "threads": 1}
    yield "ray.Detect()", Detect(), {"batch": {"path": []}}
    yield "ray.write", write, {"dataset": None, "folder": folder, "shards": 0, "val_share": 0.1}


def test_values_that_fit_nothing_are_no_panic(tmp_path: Path, products: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tried = refused = 0
    for name, call, values in calls(tmp_path, products):
        for changed in values:
            for junk in JUNK:
                try:
                    call(**{**values, changed: junk})
                except errors.InternalError as error:
                    raise AssertionError(f"{name} with {changed} = {junk!r:.60}: {error}") from error
                except Exception as error:  # noqa: BLE001 - a panic is no Exception, and fails the test
                    assert str(error) or isinstance(error, StopIteration), f"{name} with {changed} = {junk!r:.60} says nothing"
                    refused += 1
                tried += 1
    assert tried > 4000 and refused > tried / 2
