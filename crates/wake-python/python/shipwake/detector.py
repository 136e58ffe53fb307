"""Wakes in images, found by a small network whose weights come with the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .product import Product

__all__ = ["LEAST_SCORE", "Detection", "Detector"]

LEAST_SCORE = 0.03
"""Wakes of a lower score are left out, unless they are asked for."""


@dataclass(frozen=True, eq=False)
class Detection:
    """A wake that was found. Pixels are (column, row), whole numbers at the centres of pixels."""

    score: float
    """How sure the detector is, 0 to 1: an order, not a probability."""
    probability: float | None
    """Probability of a wake, in either direction; ``None`` for weights without a calibration."""
    direction_probability: float | None
    """Probability that tip and end are not taken for each other, if it is a wake; ``None`` for weights without a calibration, and
    where the score is 0."""
    sure: bool
    """Whether it counts as found: the score is at least that of the calibration, 0.25 without one."""
    tip: tuple[float, float]
    """Where the wake begins [pixels]."""
    axis_deg: float
    """From the tip along the wake, clockwise from the top of the image [degrees]."""
    half_angle_deg: float
    """Half the angle between the outer edges [degrees]."""
    length: float
    """Visible length [pixels]."""
    length_sd: float | None
    """Standard deviation of the length [pixels]; ``None`` where the surroundings of the line do not lie in the image."""
    corners: npt.NDArray[np.float64]
    """``[4, 2]``: corners of the box along the wake, left and right of the tip first."""

    @property
    def heading_deg(self) -> float:
        """Direction of the ship, clockwise from the top of the image, 0 to 360 [degrees]."""
        return (self.axis_deg + 180.0) % 360.0


class Detector:
    """Finds ship wakes in radar images.

    Grey may have any scaling: the network reads contrast in standard deviations of the speckle around. Calls return unsure
    wakes, too; :attr:`Detection.sure` says which count as found.

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
        """The network of this package."""
        return cls._load(None)

    @classmethod
    def load(cls, file: Any) -> Detector:
        """The network of a file that ``wake train detector`` wrote, with the calibration beside it, if there is one.

        Raises:
            FileError: A file that cannot be read.
            WeightsError: Weights that do not fit, or find nothing in any image.
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
        """The wakes of an image, the surest first.

        Args:
            image: ``[rows, columns]`` grey or amplitudes, at most 20,000 a side. What is no finite number is missing: land,
                or pixels without data.
            spacing: Size of a pixel [m], 0.5 to 100; without it the scale comes from the image.
            least_score: Wakes of a lower score are left out, 0 to 1; by default as in ``wake detect``.
            intensity: Whether ``image`` holds intensities, such as the normalized radar cross-section; the detector then
                searches their square root.
            threads: Number of threads, by default one a core.

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
        """The wakes of a whole product as places on a map, the surest first.

        Each has the keys of ``wakes.json`` of ``wake detect``: ``score``, ``probability``, ``direction_probability``, ``sure``,
        ``tip`` and ``end`` (longitude, latitude), ``heading`` from true north, ``length`` [m], ``echo`` of the ship with its
        displacement, and others.

        Args:
            product: The product.
            spacing: Size of a pixel [m]; by default that of the product.
            least_score: Wakes of a lower score are left out, 0 to 1; by default as in ``wake detect``.
            coast: Sea closer to land is left out [m], 0 to 50,000; ``None`` searches land, too.
            threads: Number of threads, by default one a core.

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
    """A size of pixels that the detector takes."""
    return None if spacing is None else _check.number("spacing", spacing, 0.5, 100.0)


def lowest(score: float) -> float:
    """A least score that the detector takes."""
    return _check.number("least_score", score, 0.0, 1.0)


def sea_from(coast: float | None) -> float | None:
    """A distance from land that the detector takes."""
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


