"""Ship and wind from images, and bounds."""

from __future__ import annotations

import numpy as np
import pytest

from shipwake import Scene, bound, errors, estimate, simulate

GRID = {"rows": 160, "columns": 160, "spacing": 4}


def test_a_ship_is_found_from_a_wrong_place() -> None:
    scene = Scene(grid=GRID, ship={"speed": 9, "heading": 60, "position": [120, 60]}, radar={"incidence": 30})
    image = simulate(scene).speckled
    found = estimate(image, scene, place=(150, 40), heading=61.5)
    assert found.identifiable and found.mean.shape == image.shape
    truth = {"speed": 9.0, "heading": 60.0, "x": 120.0, "y": 60.0, "length": 195.0}
    for name, value in truth.items():
        assert abs(found.values[name] - value) < 4 * found.deviations[name], name
    # No estimate is better than the bound.
    limits = bound(scene)
    assert set(limits) == set(found.values)
    assert limits["speed"] < found.deviations["speed"]
    assert found.covariance is not None
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), list(found.deviations.values()), rtol=1e-9)
    assert found.scene["ship.speed"] == found.values["speed"]
    assert 0.999 < found.weight + sum(other.weight for other in found.alternatives) < 1.001


def test_wrong_arguments_are_named() -> None:
    scene = Scene(grid=GRID)
    image = np.ones((160, 160), np.float32)
    with pytest.raises(errors.SceneError, match="image"):
        estimate(image[:100], scene)
    with pytest.raises(errors.SceneError, match="image"):
        estimate(-image, scene)
    with pytest.raises(errors.OptionError, match="place"):
        estimate(image, scene, place=[1, 2, 3])
    with pytest.raises(errors.OptionError, match="heading_sd"):
        estimate(image, scene, heading_sd=0)
    with pytest.raises(errors.ArrayError, match="image"):
        estimate(image[0], scene)
