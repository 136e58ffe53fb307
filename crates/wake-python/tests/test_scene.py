"""Scenes: values, files, prompts, and what is refused."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

from shipwake import Scene, errors


def test_default_scene_is_that_of_the_library() -> None:
    scene = Scene()
    assert (scene["ship.speed"], scene["sea.wind_speed"], scene["grid.rows"]) == (10.0, 5.0, 512)
    assert scene.shape == (512, 512) and scene.spacing == 2.5 and scene.seed == 7
    assert scene == Scene.from_toml("[ship]")
    assert Scene(ship=None) == Scene.from_toml("")


def test_several_ships() -> None:
    scene = Scene(ship=[{"speed": 6}, {"speed": 8, "position": [100, -50]}])
    assert scene["ship.1.speed"] == 6.0 and scene["ship.2.position"] == [100.0, -50.0]
    assert scene.with_values({"ship.3.speed": 4})["ship.3.speed"] == 4.0
    assert len(scene.labels().ships) == 2


def test_numbers_of_numpy_are_numbers() -> None:
    scene = Scene(ship={"speed": np.float32(8), "position": np.array([1.5, 2])}, seed=np.int64(3))  # type: ignore[arg-type]
    assert scene == Scene(ship={"speed": 8, "position": (1.5, 2)}, seed=3)


@pytest.mark.parametrize("seed", [0, 2**63 - 1, 2**63, 2**64 - 1])
def test_every_seed_survives(seed: int) -> None:
    scene = Scene(seed=seed)
    assert scene.seed == seed == Scene(**scene.to_dict()).seed
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_text_tables_and_copies_are_the_same_scene(scene: Scene, tmp_path: Path) -> None:
    deep = scene.with_values({"sea.depth": 12.5, "radar.looks": 2})
    for one in (scene, deep, Scene(ship=None), Scene(radar={"sensor": "sentinel-1-iw"})):
        assert Scene.from_toml(one.to_toml()) == one
        assert Scene(**one.to_dict()) == one
        assert copy.deepcopy(one) == one and hash(copy.copy(one)) == hash(one)
    path = tmp_path / "scene.toml"
    path.write_text(deep.to_toml())
    assert Scene.read(path) == deep != scene
    assert Scene()["sea.depth"] == float("inf")


def test_prompts(scene: Scene) -> None:
    for wording in ("paper", "wind-first", "radar-first", "brief"):
        again = Scene.from_prompt(scene.prompt(wording), base=scene)
        assert again == scene, wording
    assert Scene.from_prompt("no ship, wind 4 m/s").to_dict()["ship"] is None


def test_labels_and_plan_need_no_image(scene: Scene) -> None:
    plan = scene.plan()
    assert plan.core_seconds > 0 and plan.bytes > 0 and any(term.used for term in plan.terms)
    assert "speckle" in str(plan)
    [ship] = scene.labels().ships
    assert ship["ship"]["speed"] == 8.0


@pytest.mark.parametrize(
    ("tables", "error", "words"),
    [
        ({"ship": {"speed": 80}}, errors.SceneError, "ship.speed is 80, outside 0 to 40"),
        ({"sea": {"wind_speed": float("nan")}}, errors.SceneError, "wind_speed is NaN"),
        ({"sea": {"wind_speed": float("inf")}}, errors.SceneError, "wind_speed is inf"),
        ({"sea": {"wind_speed": "strong"}}, errors.SceneError, "strong"),
        ({"sea": {"wind": 3}}, errors.SceneError, "wind"),
        ({"grid": {"rows": 10**6}}, errors.SceneError, "grid.rows"),
        ({"grid": {"rows": 10**30}}, errors.SceneError, "scene.grid.rows"),
        ({"grid": {"rows": -1}}, errors.SceneError, "rows"),
        ({"ship": [{"speed": 3}] * 101}, errors.SceneError, "100"),
        ({"ship": {"position": [1, None]}}, TypeError, "scene.ship.position[1] is None"),
        ({"ship": 3}, TypeError, "ship"),
        ({"ship": "fast"}, TypeError, "ship"),
        ({"sea": [1]}, TypeError, "sea"),
        ({"sea": {"wind_speed": {1, 2}}}, TypeError, "set"),
        ({"sea": {3: 4}}, TypeError, "key"),
        ({"sea": {"\ud800": 4}}, (errors.ShipwakeError, UnicodeEncodeError), ""),
        ({"seed": -1}, errors.OptionError, "seed"),
        ({"seed": 2**64}, errors.OptionError, "seed"),
        ({"seed": 1.5}, errors.OptionError, "seed"),
        ({"model": {"tolerance": 0}}, errors.SceneError, "tolerance"),
    ],
)
def test_wrong_scenes_are_refused(tables: dict, error: type, words: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(error) as caught:
        Scene(**tables)
    assert words in str(caught.value)


def test_a_table_in_itself_is_refused() -> None:
    table: dict[str, object] = {}
    table["sea"] = table
    with pytest.raises(errors.SceneError, match="deeper"):
        Scene(sea=table)


def test_other_refusals(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(errors.UnknownKeyError, match="ship.sped"):
        scene.with_values({"ship.sped": 3})
    with pytest.raises(KeyError):
        scene["ship.sped"]
    with pytest.raises(errors.SceneError, match="None"):
        scene.with_values({"ship.speed": None})
    with pytest.raises(errors.SceneError, match="line 1"):
        Scene.from_toml("[sea\n")
    with pytest.raises(errors.FileError, match="nowhere"):
        Scene.read(tmp_path / "nowhere.toml")
    with pytest.raises(errors.FileError):
        Scene.read(tmp_path)
    with pytest.raises(errors.PromptError, match="states nothing"):
        Scene.from_prompt("a cat on a mat")
    with pytest.raises(errors.PromptError):
        Scene.from_prompt("a ship at 10 m/s, a ship at 3 m/s")
    with pytest.raises(errors.OptionError, match="wording"):
        scene.prompt("loud")  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        list(scene)
    for value in (None, 3, b"x"):
        with pytest.raises(errors.OptionError):
            Scene.from_toml(value)  # type: ignore[arg-type]
        with pytest.raises(errors.OptionError):
            Scene.from_prompt(value)  # type: ignore[arg-type]


def test_every_error_has_a_built_in_base() -> None:
    kinds = [getattr(errors, name) for name in errors.__all__ if name != "ShipwakeError"]
    builtin = (ValueError, KeyError, OSError, MemoryError, RuntimeError)
    assert len(kinds) == 13
    assert all(issubclass(kind, errors.ShipwakeError) and issubclass(kind, builtin) for kind in kinds)
