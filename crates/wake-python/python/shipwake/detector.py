"""Detection of wakes in images, by a small network whose weights come with the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .product import Product

__all__ = ["LEAST_SCORE", "Detection", "Detector"]

LEAST_SCORE: float = _core.LEAST_SCORE
"""Default least score: wakes with lower scores are not reported."""


@dataclass(frozen=True, eq=False)
class Detection:
    """A detected wake. Pixels are (column, row), with whole numbers at the centres of pixels."""

    score: float
    """Score, 0 to 1: a ranking, not a probability."""
    probability: float | None
    """Probability that there is a wake, in either direction; ``None`` for weights without a calibration."""
    direction_probability: float | None
    """Probability that tip and end are not swapped, if it is a wake; ``None`` for weights without a calibration, and where
    the score is 0."""
    sure: bool
    """Whether the wake counts as found: its score is at least that of the calibration, or 0.25 without a calibration."""
    tip: tuple[float, float]
    """Start of the wake [pixels]."""
    axis_deg: float
    """Direction from the tip along the wake, clockwise from the top of the image [degrees]."""
    half_angle_deg: float
    """Half the angle between the outer edges [degrees]."""
    length: float
    """Visible length [pixels]."""
    length_sd: float | None
    """Standard deviation of the length [pixels]; ``None`` where the surroundings of the line lie outside the image."""
    corners: npt.NDArray[np.float64]
    """``[4, 2]``: corners of the box along the wake, left and right of the tip first."""

    @property
    def heading_deg(self) -> float:
        """Heading of the ship, clockwise from the top of the image, 0 to 360 [degrees]."""
        return (self.axis_deg + 180.0) % 360.0


class Detector:
    """Finds ship wakes in radar images.

    Grey may have any scaling: the network measures contrast in standard deviations of the surrounding speckle. Calls also
    return uncertain wakes; :attr:`Detection.sure` marks the wakes that count as found.

    >>> import numpy as np
    >>> from shipwake import Detector
    >>> found = Detector.pretrained().find(np.full((256, 256), 90, dtype=np.uint8))
    >>> [wake for wake in found if wake.sure]
    []
    """

    __slots__ = ("_inner", "_file")

    _inner: _core.Detector
    _file: str | None

    def __init__(self) -> None:
        raise TypeError("load a detector with Detector.pretrained() or Detector.load(path)")

    @classmethod
    def pretrained(cls) -> Detector:
        """Returns the detector of this package."""
        return cls._load(None)

    @classmethod
    def load(cls, file: Any) -> Detector:
        """Loads a detector from a file of ``wake train detector``, with the calibration beside it, if there is one.

        Raises:
            FileError: A file that cannot be read.
            WeightsError: Weights that do not fit the network, or that detect nothing in any image.
        """
        return cls._load(_check.path("file", file))

    @classmethod
    def _load(cls, file: str | None) -> Detector:
        detector = cls.__new__(cls)
        detector._file = file
        detector._inner = _core.Detector.load(file, None)
        return detector

    def find(
        self,
        image: npt.ArrayLike,
        *,
        spacing: float | None = None,
        least_score: float = LEAST_SCORE,
        intensity: bool = False,
        threads: int | None = None,
    ) -> list[Detection]:
        """Returns the wakes of an image in descending order of score.

        Args:
            image: ``[rows, columns]`` grey or amplitudes, at most 20,000 pixels a side. Pixels that are not finite count as
                missing: land, or pixels without data.
            spacing: Pixel size [m], 0.5 to 100; by default, the scale is estimated from the image.
            least_score: Lowest score of the reported wakes, 0 to 1; by default as in ``wake detect``.
            intensity: Whether ``image`` holds intensities, such as the normalized radar cross-section; the detector then
                searches their square root.
            threads: Number of threads, by default one per core.

        Raises:
            ArrayError: An image without two dimensions, without pixels, or not of real numbers.
        """
        pixels = _check.array("image", image, 2, np.float32)
        if intensity:
            with np.errstate(invalid="ignore"):
                pixels = np.sqrt(pixels)
        found = self._inner.find(pixels, pixel_size(spacing), lowest(least_score), _check.threads(threads))
        return [_detection(one) for one in found]

    def find_in(
        self,
        product: Product,
        *,
        spacing: float | None = None,
        least_score: float = LEAST_SCORE,
        coast: float | None = 1000.0,
        threads: int | None = None,
    ) -> list[dict[str, Any]]:
        """Returns the wakes of a whole product with their places on a map, in descending order of score.

        Each wake has the keys of ``wakes.json`` of ``wake detect``: ``score``, ``probability``, ``direction_probability``,
        ``sure``, ``tip`` and ``end`` (longitude, latitude), ``heading`` from true north, ``length`` [m], ``echo`` of the ship
        with its displacement, and others.

        Args:
            product: The product.
            spacing: Pixel size [m]; by default, the product's.
            least_score: Lowest score of the reported wakes, 0 to 1; by default as in ``wake detect``.
            coast: Distance from land within which sea is not searched [m], 0 to 50,000; ``None`` searches land, too.
            threads: Number of threads, by default one per core.

        Raises:
            ProductError: A product without pixels, or damaged.
        """
        if not isinstance(product, Product):
            raise TypeError(f"product is {product!r:.80}, expected a Product")
        return self._inner.find_in(
            product._inner,
            pixel_size(spacing),
            lowest(least_score),
            sea_from(coast),
            _check.threads(threads),
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return Detector._load, (self._file,)


def pixel_size(spacing: float | None) -> float | None:
    """Checks a pixel size."""
    return None if spacing is None else _check.number("spacing", spacing, 0.5, 100.0)


def lowest(score: float) -> float:
    """Checks a least score."""
    return _check.number("least_score", score, 0.0, 1.0)


def sea_from(coast: float | None) -> float | None:
    """Checks a distance from land."""
    return None if coast is None else _check.number("coast", coast, 0.0, 50_000.0)


def _detection(one: Mapping[str, Any]) -> Detection:
    tip = one["tip"]
    return Detection(
        score=one["score"],
        probability=one["probability"],
        direction_probability=one["direction_probability"],
        sure=one["sure"],
        tip=(tip[0], tip[1]),
        axis_deg=one["axis_deg"],
        half_angle_deg=one["half_angle_deg"],
        length=one["length"],
        length_sd=one["length_sd"],
        corners=np.asarray(one["corners"], dtype=np.float64),
    )


