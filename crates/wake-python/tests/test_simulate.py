"""Images: the same as the Rust program's, the same on any number of threads, and their forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import shipwake
from shipwake import FIELDS, Scene, errors, expected_intensity, simulate, simulate_batch


def test_a_simulation_has_all_its_parts(scene: Scene) -> None:
    made = simulate(scene)
    assert set(made.fields) == set(FIELDS)
    assert all(field.shape == (48, 40) and field.dtype == np.float32 for field in made.fields.values())
    assert all(np.isfinite(field).all() for field in made.fields.values())
    assert made.slc is None and made.scene == scene
    assert made.speckled is made.fields["speckled"]
    assert made.labels.ships == scene.labels().ships
    assert made.seconds["total"] > 0
    # Speckle of four looks has mean 1: its mean over 1,920 pixels is within five deviations.
    assert abs(made.speckled.mean() / made.intensity.mean() - 1) < 5 / np.sqrt(4 * 1920)
    # Elevation is the sum over waves of amplitude times cosine, so its mean is small against its spread.
    assert made.fields["elevation"].std() > 0


def test_threads_change_nothing(scene: Scene) -> None:
    one, three = simulate(scene, threads=1), simulate(scene, threads=3)
    for name in FIELDS:
        np.testing.assert_array_equal(one.fields[name], three.fields[name])


def test_the_fast_methods_keep_the_tolerance(scene: Scene) -> None:
    scene = scene.with_values({"grid.rows": 24, "grid.columns": 24})
    fast, slow = simulate(scene), simulate(scene, direct=True)
    difference = np.sqrt(np.mean((fast.intensity - slow.intensity) ** 2)) / slow.intensity.mean()
    assert difference <= scene["model.tolerance"]


def test_a_sensor_of_one_look_has_a_complex_image() -> None:
    scene = Scene(radar={"sensor": "terrasar-x-sm", "looks": 1}, grid={"rows": 32, "columns": 32})
    made = simulate(scene)
    assert made.slc is not None and made.slc.dtype == np.complex64
    # The square of a modulus, rounded.
    np.testing.assert_allclose(np.abs(made.slc) ** 2, made.speckled, rtol=1e-5)


def test_expected_intensity_has_no_sea(scene: Scene) -> None:
    mean = expected_intensity(scene)
    other = expected_intensity(scene.with_values({"seed": 8}))
    np.testing.assert_array_equal(mean, other)
    assert mean.shape == scene.shape and (mean > 0).all()


def test_pictures(scene: Scene, tmp_path: Path) -> None:
    made = simulate(scene)
    path = tmp_path / "wake.png"
    made.write_png(path)
    content = path.read_bytes()
    assert content == made._repr_png_() and content.startswith(b"\x89PNG")
    levels = made.levels()
    assert levels.shape == scene.shape and levels.dtype == np.uint8 and levels.std() > 5
    # Grey is linear in amplitude between the ends.
    dark, bright = (10 ** (made.grey[end] / 20) for end in ("darkest_db", "brightest_db"))
    grey = np.clip((np.sqrt(made.speckled.astype(float)) - dark) / (bright - dark), 0, 1)
    assert np.abs(levels - 255 * grey).max() <= 0.51
    with pytest.raises(errors.FileError, match="nowhere"):
        made.write_png(tmp_path / "nowhere" / "wake.png")


def test_xarray_has_places_and_units(scene: Scene) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed: to_xarray is not tested")
    made = simulate(scene)
    data = made.to_xarray()
    assert data.sizes == {"y": 48, "x": 40} and data["sigma0"].attrs["units"] == "1"
    # The origin is pixel [rows/2, columns/2]; azimuth falls with the row.
    assert float(data.y[24]) == 0 and float(data.x[20]) == 0 and float(data.y[0]) == 24 * 5
    np.testing.assert_array_equal(data["speckled"].values, made.speckled)
    assert Scene.from_toml(data.attrs["scene"]) == scene


def test_a_batch_is_deterministic_in_the_index() -> None:
    base = Scene(grid={"rows": 32, "columns": 24, "spacing": 5})
    theta = np.array([[6.0, 30.0], [8.0, 60.0], [10.0, 90.0], [10.0, 90.0]])
    keys = ["ship.speed", "ship.heading"]
    whole = simulate_batch(theta, keys, base=base, seed=5)
    assert whole.shape == (4, 1, 32, 24) and whole.dtype == np.float32
    # Two rows of equal values have seas of their own.
    assert not np.array_equal(whole[2], whole[3])
    parts = [simulate_batch(theta[k : k + 2], keys, base=base, seed=5, first=k, threads=1) for k in (0, 2)]
    np.testing.assert_array_equal(whole, np.concatenate(parts))
    assert not np.array_equal(whole, simulate_batch(theta, keys, base=base, seed=6))
    plain = simulate_batch(theta, keys, base=base, seed=5, speckle=False)
    ratio = whole.mean(axis=(1, 2, 3)) / plain.mean(axis=(1, 2, 3))
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(4 * 32 * 24)


def test_a_batch_is_the_simulation_of_its_scenes() -> None:
    base = Scene(grid={"rows": 32, "columns": 24, "spacing": 5})
    [image] = simulate_batch([[8.0, 11.0]], ["ship.speed", "seed"], base=base)
    np.testing.assert_array_equal(image[0], simulate(base.with_values({"ship.speed": 8, "seed": 11})).speckled)


@pytest.mark.parametrize(
    ("theta", "keys", "error", "words"),
    [
        ([1.0, 2.0], ["ship.speed"], errors.ArrayError, "shape 2"),
        ([[1.0, 2.0]], ["ship.speed"], errors.ArrayError, "1 keys"),
        ([[]], [], errors.ArrayError, "no column"),
        ([[float("nan")]], ["ship.speed"], errors.SceneError, "ship.speed is NaN"),
        ([[50.0]], ["ship.speed"], errors.SceneError, "ship.speed is 50"),
        ([[5.0]], ["ship.sped"], errors.UnknownKeyError, "sped"),
        ([["fast"]], ["ship.speed"], errors.ArrayError, "expected real numbers"),
        ([[1 + 2j]], ["ship.speed"], errors.ArrayError, "complex"),
        ([[1.0], [2.0, 3.0]], ["ship.speed"], errors.ArrayError, "not an array"),
        ([[64.0]], ["grid.rows"], errors.ArrayError, "row 0"),
        ([[5.0]], "ship.speed", errors.OptionError, "keys"),
        ([[5.0]], [3], errors.OptionError, "a key"),
        (np.zeros((10**9, 0)), [], errors.ArrayError, "no column"),
    ],
)
def test_wrong_batches_are_refused(theta: object, keys: object, error: type, words: str) -> None:
    with pytest.raises(error) as caught:
        simulate_batch(theta, keys)  # type: ignore[arg-type]
    assert words in str(caught.value)


def test_an_empty_batch_is_no_image() -> None:
    base = Scene(grid={"rows": 8, "columns": 9})
    assert simulate_batch(np.zeros((0, 1)), ["ship.speed"], base=base).shape == (0, 1, 8, 9)


def test_huge_images_and_batches_are_refused() -> None:
    huge = Scene(grid={"rows": 16384, "columns": 16384, "spacing": 0.5, "oversampling": 16})
    with pytest.raises(errors.TooLargeError, match="GiB"):
        simulate(huge)
    with pytest.raises(MemoryError):
        huge.plan()
    # The array of values is small; its images would not fit.
    with pytest.raises(errors.TooLargeError, match="images of 16384 x 16384"):
        simulate_batch(np.full((10**4, 1), 8.0), ["ship.speed"], base=huge)


@pytest.mark.parametrize("threads", [0, -1, 10**6, 1.5, "two"])
def test_wrong_numbers_of_threads_are_refused(scene: Scene, threads: object) -> None:
    with pytest.raises(errors.OptionError, match="threads"):
        simulate(scene, threads=threads)  # type: ignore[arg-type]


def test_what_is_no_scene_is_refused() -> None:
    for value in (None, 3, {"ship": {}}, "a ship"):
        with pytest.raises(TypeError, match="Scene"):
            simulate(value)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="Scene"):
            expected_intensity(value)  # type: ignore[arg-type]


def test_calls_leave_the_interpreter_to_others(scene: Scene) -> None:
    """While one thread simulates, another counts."""
    import threading

    counts: list[int] = []
    done = threading.Event()

    def count() -> None:
        number = 0
        while not done.is_set():
            number += 1
        counts.append(number)

    thread = threading.Thread(target=count)
    thread.start()
    for seed in range(3):
        simulate(scene.with_values({"seed": seed, "grid.rows": 256, "grid.columns": 256}), threads=1)
    done.set()
    thread.join()
    assert counts[0] > 100_000


def test_the_version_is_that_of_the_crates() -> None:
    assert shipwake.__version__ == "0.2.0"
