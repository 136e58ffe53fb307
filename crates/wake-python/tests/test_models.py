"""The networks: what they draw and find, and what they refuse."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from shipwake import Detector, Sampler, Scene, errors, simulate

WEIGHTS = Path(__file__).parents[2] / "wake-detector" / "assets"


@pytest.fixture(scope="module")
def sampler() -> Sampler:
    return Sampler.pretrained()


@pytest.fixture(scope="module")
def detector() -> Detector:
    return Detector.pretrained()


def test_a_prompt_becomes_an_image(sampler: Sampler) -> None:
    sample = sampler.sample("a ship at 8 m/s toward 135 degrees, wind 5 m/s", seed=3)
    assert sample.grey.shape == (256, 256) and 0 <= sample.grey.min() and sample.grey.max() <= 1
    assert (sample.scene["ship.speed"], sample.scene["ship.heading"], sample.scene.seed) == (8.0, 135.0, 3)
    assert sample._repr_png_().startswith(b"\x89PNG") and sample.levels().std() > 5
    # Four looks of speckle have mean 1 over 65,536 pixels.
    assert abs((sample.speckled / sample.intensity).mean() - 1) < 5 / np.sqrt(4 * 65536)
    # The scene that was drawn draws the same image again.
    again = sampler.sample(sample.scene, threads=1)
    np.testing.assert_array_equal(again.grey, sample.grey)


def test_a_batch_has_seeds_in_order(sampler: Sampler) -> None:
    prompt = "no ship, wind 5 m/s toward north"
    one, two = sampler.sample([prompt, prompt], seed=5)
    assert (one.scene.seed, two.scene.seed) == (5, 6) and not np.array_equal(one.grey, two.grey)
    # Batches are summed in another order.
    np.testing.assert_allclose(sampler.sample(prompt, seed=6).grey, two.grey, atol=1e-4)
    assert pickle.loads(pickle.dumps(sampler)).sample(prompt, seed=5).scene == one.scene


def test_wrong_prompts_are_refused(sampler: Sampler, tmp_path: Path) -> None:
    with pytest.raises(errors.PromptError, match="states nothing"):
        sampler.sample("a cat")
    with pytest.raises(errors.PromptError, match="ship.speed"):
        sampler.sample("a ship at 90 m/s")
    with pytest.raises(errors.OptionError, match="at least one"):
        sampler.sample([])
    with pytest.raises(errors.OptionError, match="not both"):
        sampler.sample(["a ship", Scene()])  # type: ignore[list-item]
    with pytest.raises((errors.OptionError, TypeError)):
        sampler.sample(3)  # type: ignore[call-overload]
    with pytest.raises(errors.OptionError, match="512"):
        sampler.sample(Scene())
    with pytest.raises(errors.OptionError, match="seed"):
        sampler.sample("a ship at 5 m/s", seed=-1)
    with pytest.raises(errors.TooLargeError):
        sampler.sample(["a ship at 5 m/s"] * 10**6)
    for steps in (0, 1001, 2.5):
        with pytest.raises(errors.OptionError, match="steps"):
            Sampler.pretrained(steps=steps)  # type: ignore[arg-type]
    with pytest.raises(errors.OptionError, match="mode"):
        Sampler.pretrained(mode="none")  # type: ignore[arg-type]
    with pytest.raises(errors.FileError):
        Sampler.from_folder(tmp_path)
    with pytest.raises(TypeError):
        Sampler()


def test_a_wake_is_found_where_it_is(detector: Detector) -> None:
    scene = Scene(
        ship={"speed": 8, "heading": 90, "echo": True, "edge": True, "position": [300, 0]},
        sea={"wind_speed": 4},
        radar={"sensor": "sentinel-1-iw"},
        grid={"rows": 256, "columns": 256},
    )
    made = simulate(scene)
    # Pixels of 10 m: midship lies 30 columns right of the middle, the wake leads to the left.
    tip, axis = (158.0, 128.0), 270.0
    for image in (made.levels(), np.sqrt(made.speckled), made.levels().astype(np.uint16) * 257):
        best, *_ = detector.find(image, spacing=scene.spacing, least_score=0.03)
        # Within forty pixels the detector takes two tips for one; axes of one wake are within 30 degrees.
        assert np.hypot(best.tip[0] - tip[0], best.tip[1] - tip[1]) < 40
        assert abs((best.axis_deg - axis + 180) % 360 - 180) < 30
        assert best.corners.shape == (4, 2) and best.heading_deg == (best.axis_deg + 180) % 360
    one = detector.find(made.speckled, spacing=scene.spacing, intensity=True)
    two = detector.find(np.sqrt(made.speckled), spacing=scene.spacing, threads=1)
    assert [w.score for w in one] == [w.score for w in two]
    again = pickle.loads(pickle.dumps(detector)).find(made.levels(), spacing=scene.spacing)
    assert [w.score for w in again] == [w.score for w in detector.find(made.levels(), spacing=scene.spacing)]


def test_probabilities_are_those_of_the_calibration(detector: Detector) -> None:
    calibration = json.loads((WEIGHTS / "detector.calibration.json").read_text())
    image = np.random.default_rng(3).gamma(4.0, size=(256, 256))
    image[128:132, 20:230] *= 0.4
    for spacing, name in ((10.0, "known_spacing"), (None, "unknown_spacing")):
        known = calibration[name]
        found = detector.find(image, spacing=spacing, least_score=0.0, intensity=True)
        assert found[0].sure and not found[-1].sure
        for one in found:
            # The formula of the page, in double precision, of a score in single precision, to a result in single precision.
            x = min(max(one.score, 1e-6), 1 - 1e-6)
            logit = known["wake"]["a"] * np.log(x) - known["wake"]["b"] * np.log1p(-x) + known["wake"]["c"]
            assert one.probability == pytest.approx(1 / (1 + np.exp(-logit)), rel=1e-6)
            if one.score > 0:
                assert one.direction_probability is not None and 0 <= one.direction_probability <= 1
            assert one.sure == (one.score >= known["sure_from"])


def test_weights_of_a_file_have_the_calibration_beside_it(detector: Detector, tmp_path: Path) -> None:
    image = np.random.default_rng(3).gamma(4.0, size=(256, 256))
    image[128:132, 20:230] *= 0.4
    expected = detector.find(image, intensity=True)
    file = tmp_path / "detector.safetensors"
    file.write_bytes((WEIGHTS / "detector.safetensors").read_bytes())
    found = Detector.load(file).find(image, intensity=True)
    assert [one.score for one in found] == [one.score for one in expected]
    for one in found:
        assert one.probability is None and one.direction_probability is None and one.sure == (one.score >= 0.25)
    beside = tmp_path / "detector.calibration.json"
    beside.write_bytes((WEIGHTS / "detector.calibration.json").read_bytes())
    found = Detector.load(file).find(image, intensity=True)
    assert [one.probability for one in found] == [one.probability for one in expected]
    beside.write_text("{}")
    with pytest.raises(errors.WeightsError, match="calibration"):
        Detector.load(file)


def test_missing_pixels_hold_no_wake(detector: Detector) -> None:
    nothing = np.full((100, 120), np.nan, dtype=np.float32)
    assert detector.find(nothing) == []
    for value in (np.inf, -np.inf, 1e38, -1.0, 0.0):
        image = np.full((70, 90), value, dtype=np.float64)
        assert detector.find(image) == [] and detector.find(image, intensity=True) == []
    assert detector.find(np.full((70, 90), 1e300)) == []
    mixed = np.random.default_rng(1).normal(size=(128, 128))
    mixed[::7] = np.nan
    mixed[5, 5] = np.inf
    assert all(np.isfinite(one.score) for one in detector.find(mixed, least_score=0.0))


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros(5), "2 dimensions"),
        (np.zeros((3, 4, 5)), "2 dimensions"),
        (np.float32(3), "no dimension"),
        (np.zeros((0, 5)), "outside 1 to 20000"),
        (np.zeros((1, 20_001), dtype=np.uint8), "20001"),
        (np.array([["a", "b"]]), "real numbers"),
        (np.zeros((4, 4), dtype=complex), "complex128"),
        (np.array([[None, object()]]), "object"),
        (None, "object"),
        ("image.png", "real numbers"),
        ([[1, 2], [3]], "not an array"),
    ],
)
def test_wrong_images_are_refused(detector: Detector, image: object, words: str) -> None:
    with pytest.raises(errors.ArrayError) as caught:
        detector.find(image)  # type: ignore[arg-type]
    assert words in str(caught.value)


def test_images_of_any_layout(detector: Detector) -> None:
    image = np.random.default_rng(2).integers(0, 255, (96, 130), dtype=np.uint8)
    expected = [one.score for one in detector.find(image, least_score=0.0)]
    for other in (np.asfortranarray(image), image[::-1][::-1], image.astype(">i4"), image.tolist()):
        assert [one.score for one in detector.find(other, least_score=0.0)] == expected
    assert detector.find(np.zeros((1, 1))) == []
    assert detector.find(np.zeros((3, 3), dtype=bool)) == []


def test_other_refusals(detector: Detector, tmp_path: Path) -> None:
    image = np.zeros((64, 64))
    for spacing in (0, 1000, float("nan"), "ten"):
        with pytest.raises(errors.OptionError, match="spacing"):
            detector.find(image, spacing=spacing)  # type: ignore[arg-type]
    for score in (-0.1, 1.1, float("nan"), None):
        with pytest.raises(errors.OptionError, match="least_score"):
            detector.find(image, least_score=score)  # type: ignore[arg-type]
    with pytest.raises(errors.FileError):
        Detector.load(tmp_path / "nowhere.safetensors")
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"\x00" * 100)
    with pytest.raises(errors.WeightsError):
        Detector.load(broken)
    with pytest.raises(TypeError):
        Detector()
    with pytest.raises(TypeError, match="Product"):
        detector.find_in(image)  # type: ignore[arg-type]
