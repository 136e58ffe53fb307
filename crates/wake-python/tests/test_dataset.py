"""Data sets: deterministic by index, as folders, and as those of Hugging Face."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shipwake import Dataset, Scene, errors, merge_shards
from shipwake.dataset import png

FIRST = {"scene.grid.rows": 32, "scene.grid.columns": 24, "scene.grid.spacing": 20, "draw.count": 1, "speckle": True}


def tree(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def same(one: Mapping[str, Any], other: Mapping[str, Any]) -> None:
    for name in ("index", "prompt", "scene", "amplitudes"):
        assert one[name] == other[name], name
    for name in ("image", "boxes", "corners", "classes"):
        np.testing.assert_array_equal(one[name], other[name])


def test_items_are_functions_of_their_index(data: Dataset) -> None:
    assert len(data) == 6 and data.shape == (32, 24) and data.seed == 3
    again = Dataset(seed=3, count=6, changes=FIRST, threads=1)
    for index in (5, 0, -1):
        same(data[index], again[index])
    item = data[2]
    assert item["image"].shape == (1, 32, 24) and item["image"].dtype == np.float32
    assert 0 <= item["image"].min() and item["image"].max() <= 1
    assert item["scene"] == data.scene(2) and item["prompt"] == item["scene"].prompt()
    assert data.without_image(2)["image"].size == 0
    other = Dataset(seed=4, count=6, changes=FIRST)
    assert not np.array_equal(other[0]["image"], data[0]["image"])
    assert [one["index"] for one in data] == list(range(6))


def test_boxes_are_those_of_the_labels() -> None:
    data = Dataset("ranges", count=20, changes={"draw.count": 1, "scene.ship.echo": True})
    kinds = set()
    for index in range(20):
        item = data.without_image(index)
        objects = item["labels"].objects
        assert item["boxes"].shape == (len(objects), 4) and item["corners"].shape == (len(objects), 4, 2)
        for thing, box, corners in zip(objects, item["boxes"], item["corners"], strict=True):
            left, top, width, height = thing.box
            # Half a pixel, in steps of a hundredth, as 32-bit numbers of some hundreds.
            expected = np.array([left, top, left + width, top + height]) + 0.5
            np.testing.assert_allclose(box, expected, atol=0.011)
            np.testing.assert_allclose(corners, thing.corners + 0.5, atol=0.0051)
            kinds.add(thing.name)
    assert kinds == {"wake", "ship"}


def test_batches_hold_the_items(data: Dataset) -> None:
    batches = list(data.batches(4))
    assert [len(batch["prompt"]) for batch in batches] == [4, 2]
    for number, batch in enumerate(batches):
        for k, index in enumerate(batch["index"]):
            assert index == 4 * number + k
            item = data[int(index)]
            np.testing.assert_array_equal(batch["image"][k], item["image"])
            assert batch["scene"][k] == item["scene"]
    [last] = data.batches(4, start=1)
    np.testing.assert_array_equal(last["image"], batches[1]["image"])


def test_recipes_come_by_name_file_and_tables(tmp_path: Path) -> None:
    tables = {"base": "detector", "scene": {"grid": {"rows": 16, "columns": 16}}, "draw": {"count": [1, 2]}}
    text = 'base = "detector"\n[scene.grid]\nrows = 16\ncolumns = 16\n[draw]\ncount = [1, 2]\n'
    path = tmp_path / "mine.toml"
    path.write_text(text)
    changes = {"scene.grid.rows": 16, "scene.grid.columns": 16, "draw.count": [1, 2]}
    sets = [Dataset(tables), Dataset(path), Dataset(str(path)), Dataset("detector", changes=changes)]
    path.unlink()
    sets += [pickle.loads(pickle.dumps(one)) for one in sets]
    assert len({one.recipe for one in sets}) == 1
    for one in sets:
        same(one.without_image(7), sets[0].without_image(7))
    assert len(Dataset("paper")) == 3456


def test_a_folder_is_that_of_the_program(data: Dataset, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    assert data.write(tmp_path / "one", threads=1, progress=lambda *now: told.append(now)) == 6
    assert told[0] == (0, 6) and told[-1] == (6, 6)
    assert data.write(tmp_path / "one") == 0
    assert data.write(tmp_path / "two", threads=3) == 6
    assert tree(tmp_path / "one") == tree(tmp_path / "two")
    for number in (1, 0):
        data.write(tmp_path / "three", shard=(number, 2))
    assert merge_shards(tmp_path / "three") == 6
    assert tree(tmp_path / "one") == tree(tmp_path / "three")
    rows = [json.loads(line) for line in (tmp_path / "one" / "metadata.jsonl").open()]
    for row, item in zip(rows, data, strict=True):
        assert (tmp_path / "one" / row["file_name"]).read_bytes() == png(item["image"])
        left, top, right, bottom = item["boxes"].T
        boxes = np.stack([left, top, right - left, bottom - top], axis=1).reshape(-1, 4)
        np.testing.assert_allclose(np.reshape(row["objects"]["bbox"], (-1, 4)), boxes, atol=1e-4)
        assert row["text"] == item["prompt"] and row["seed"] == item["scene"].seed


def test_a_set_of_hugging_face(data: Dataset) -> None:
    pytest.importorskip("datasets", reason="datasets is not installed: to_hf is not tested")
    pytest.importorskip("PIL", reason="pillow is not installed: to_hf is not tested")
    rows = data.to_hf()
    assert rows.column_names == ["image", "text", "objects", "scene"] and len(rows) == 6
    for row, item in zip(rows, data, strict=True):
        grey = np.floor(255 * item["image"][0] + 0.5).astype(np.uint8)
        np.testing.assert_array_equal(np.asarray(row["image"]), grey)
        assert row["objects"]["categories"] == item["classes"].tolist()
        assert Scene.from_toml(row["scene"]) == item["scene"]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"recipe": "papper"}, errors.OptionError, "papper"),
        ({"recipe": "no.toml"}, errors.FileError, "no.toml"),
        ({"recipe": 3}, errors.OptionError, "recipe is 3"),
        ({"recipe": {"speckel": True}}, errors.RecipeError, "speckel"),
        ({"recipe": {"draw": {"ship.speed": [12, 6]}}}, errors.ShipwakeError, "lower first"),
        ({"changes": {"scene.sea.wind_sped": 3}}, errors.RecipeError, "wind_sped"),
        ({"changes": {"scene.sea.wind_speed": float("nan")}}, errors.SceneError, "NaN"),
        ({"changes": {"scene.sea.wind_speed": None}}, errors.RecipeError, "None"),
        ({"changes": {"scene.radar.looks": 0}}, errors.SceneError, "radar.looks"),
        ({"changes": {"a]\n[b": 1}}, errors.RecipeError, ""),
        ({"count": 0}, errors.OptionError, "count"),
        ({"count": 10**30}, errors.OptionError, "count"),
        ({"seed": -1}, errors.OptionError, "seed"),
        ({"threads": 0}, errors.OptionError, "threads"),
    ],
)
def test_wrong_recipes_are_refused(arguments: dict, error: type, words: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(error) as caught:
        Dataset(**arguments)
    assert words in str(caught.value)


def test_other_refusals(data: Dataset, tmp_path: Path) -> None:
    for index in (6, -7, 10**30):
        with pytest.raises(IndexError):
            data[index]
    for value in ("0", None, 1.0):
        with pytest.raises(TypeError):
            data[value]  # type: ignore[index]
    with pytest.raises(errors.OptionError):
        data.batches(0)
    with pytest.raises(IndexError):
        data.batch(2, 4)
    with pytest.raises(errors.OptionError, match="val_share"):
        data.write(tmp_path / "a", val_share=2)
    for shard in ((2, 2), (-1, 2), (0, 0), 3, (1, 2, 3)):
        with pytest.raises(errors.OptionError):
            data.write(tmp_path / "a", shard=shard)  # type: ignore[arg-type]
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "file").write_text("mine")
    with pytest.raises(errors.DatasetError, match="not empty"):
        data.write(tmp_path / "b")
    with pytest.raises(errors.FileError):
        data.write(tmp_path / "b" / "file" / "c")
    with pytest.raises(errors.DatasetError, match="missing"):
        merge_shards(tmp_path / "nowhere")
    with pytest.raises(RuntimeError, match="mine"):
        data.write(tmp_path / "c", progress=fail)
    huge = Dataset(count=10**6, changes={"scene.grid.rows": 16384, "scene.grid.columns": 16384})
    with pytest.raises(errors.TooLargeError):
        huge.batch(0, 10**4)


def fail(*_: int) -> None:
    raise RuntimeError("mine")
