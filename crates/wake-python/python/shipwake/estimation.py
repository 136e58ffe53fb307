"""Estimates of ship and wind from images, with error bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .errors import OptionError
from .scene import Scene, _scene

__all__ = ["Alternative", "Estimate", "bound", "estimate"]


@dataclass(frozen=True)
class Alternative:
    """Another maximum of the likelihood: the opposite wind, or another speed."""

    scene: Scene
    """The scene at the maximum."""
    weight: float
    """Probability of this maximum, 0 to 1."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Result of :func:`estimate`. Names of values: ``speed`` [m/s], ``heading`` [deg], ``x`` and ``y`` of midship [m],
    ``length`` [m], ``wind_speed`` [m/s], ``wind_toward`` [deg], and the logarithms of ``gain`` and ``texture``."""

    identifiable: bool
    """Whether the image determines ship and wind; if not, the values are meaningless."""
    values: dict[str, float]
    """Values by name."""
    deviations: dict[str, float]
    """Standard deviations by name; infinite where the image does not determine a value."""
    covariance: npt.NDArray[np.float64] | None = field(repr=False)
    """Covariance in the order of the values; ``None`` if the image leaves a value undetermined."""
    scene: Scene = field(repr=False)
    """The most likely scene."""
    mean: npt.NDArray[np.float32] = field(repr=False)
    """Mean image of this scene, in the unit of the image."""
    weight: float
    """Probability of this maximum, 0 to 1."""
    alternatives: list[Alternative] = field(repr=False)
    """Other maxima."""
    log_likelihood: float
    """Log-likelihood, up to a constant that depends on the image."""
    over_open_sea: float
    """Log-likelihood ratio to a sea without the ship."""
    power: list[float] = field(repr=False)
    """Power of the residual over its expectation in rings of wavenumbers, longest waves first: 1 for a perfect model."""
    misfit: float
    """Largest deviation of ``power`` from 1, as a factor."""
    by_echo: tuple[float, float] | None
    """Velocity toward the radar from the displacement of the ship's echo alone, and its standard deviation [m/s]."""


def estimate(
    image: npt.ArrayLike,
    known: Scene,
    *,
    place: Sequence[float] | None = None,
    heading: float | None = None,
    place_sd: float = 60.0,
    heading_sd: float = 3.0,
    calibrated: bool = True,
    threads: int | None = None,
) -> Estimate:
    """Estimates ship and wind from an image of a wake, for ship speeds from 3.5 to 17 m/s.

    Searches within 2.5 standard deviations of place and heading. Takes about a minute for 256 x 256 pixels on two cores.

    Args:
        image: Intensity with speckle, ``[rows, columns]`` of the scene's grid, in the unit of the normalized radar cross-section.
        known: Radar, grid, water and hull. Its ship speed and wind are not used, except the wind speed if not ``calibrated``.
        place: Midship ``(x, y)`` [m], by default from the first ship of ``known``.
        heading: Heading [deg clockwise from azimuth], by default from the first ship of ``known``.
        place_sd: Standard deviation of the place along each axis [m].
        heading_sd: Standard deviation of the heading [deg].
        calibrated: Whether the brightness of the image is known within 3 %.
        threads: Number of threads, by default one per core.

    Raises:
        SceneError: An image of another size, or with negative or non-finite values; a scene without exactly one ship.
    """
    where = None
    if place is not None:
        pair = _check.array("place", place, 1, np.float64)
        if pair.shape != (2,):
            raise OptionError(f"place has {pair.size} numbers, expected x and y")
        where = (float(pair[0]), float(pair[1]))
    found: dict[str, Any] = _core.estimate(
        _check.array("image", image, 2, np.float32),
        _scene("known", known)._inner,
        where,
        None if heading is None else _check.number("heading", heading, -1e6, 1e6),
        (_check.number("place_sd", place_sd, 1e-3, 1e4), _check.number("heading_sd", heading_sd, 1e-3, 90)),
        bool(calibrated),
        _check.threads(threads),
    )
    found["scene"] = Scene._of(found["scene"])
    found["alternatives"] = [Alternative(Scene._of(scene), weight) for scene, weight in found["alternatives"]]
    return Estimate(**found)


def bound(scene: Scene, *, calibrated: bool = True, threads: int | None = None) -> dict[str, float]:
    """Cramér–Rao bound: smallest standard deviations of unbiased estimates from one image of the scene, by name.

    Names and units are as in :class:`Estimate`. Values that the image does not determine have an infinite bound.

    >>> from shipwake import Scene, bound
    >>> limits = bound(Scene(grid={"rows": 96, "columns": 96}))
    >>> limits["speed"] < 0.1
    True

    Args:
        scene: Sea, ship, radar and pixels.
        calibrated: Whether the brightness of the image is known within 3 %.
        threads: Number of threads, by default one per core.
    """
    return _core.bound(_scene("scene", scene)._inner, bool(calibrated), _check.threads(threads))
