"""Satellite products and other georeferenced rasters."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _check, _core

__all__ = ["Product"]


class Product:
    """A Sentinel-1 GRD product, a GeoTIFF, or a PNG or JPEG image without georeference.

    Lines and pixels count from 0, with whole numbers at the centres of pixels.

    ``product = Product.open("S1A_IW_GRDH_….SAFE")``
    """

    __slots__ = ("_inner", "_polarization", "path")

    _inner: _core.Product
    _polarization: str | None
    path: str
    """Path of the product."""

    def __init__(self) -> None:
        raise TypeError("open a product with Product.open(path)")

    @classmethod
    def open(cls, path: Any, polarization: str | None = None) -> Product:
        """Opens a ``.SAFE`` folder, its ``.zip``, or a TIFF, PNG or JPEG file; only the header is read.

        Args:
            path: The product.
            polarization: ``"VV"``, ``"HH"``, ``"VH"`` or ``"HV"`` of a Sentinel-1 product; by default the first of these that
                the product has.

        Raises:
            FileError: A path that cannot be read.
            ProductError: A file that is not a product, or is damaged.
        """
        product = cls.__new__(cls)
        product.path = _check.path("path", path)
        product._polarization = None if polarization is None else _check.text("polarization", polarization)
        product._inner = _core.Product.open(product.path, product._polarization)
        return product

    @property
    def shape(self) -> tuple[int, int]:
        """Number of lines, and of pixels per line."""
        return self._inner.shape()

    @property
    def is_calibrated(self) -> bool:
        """Whether values are the normalized radar cross-section; otherwise they are the samples of the file."""
        return self._inner.is_calibrated()

    @property
    def has_pixels(self) -> bool:
        """Whether pixels can be read. A Sentinel-1 product may consist of its annotation only."""
        return self._inner.has_pixels()

    @property
    def has_places(self) -> bool:
        """Whether latitudes and longitudes are known."""
        return self._inner.has_places()

    def read(self, lines: slice | None = None, pixels: slice | None = None) -> npt.NDArray[np.float32]:
        """Returns the values of a window ``[lines, pixels]``, with NaN where there are no data.

        Args:
            lines: Range of lines, such as ``slice(4000, 5024)``; by default all.
            pixels: Range of pixels of each line; by default all.

        Raises:
            OptionError: A window that is empty or reaches beyond the image.
        """
        rows, columns = self.shape
        return self._inner.read(_range("lines", lines, rows), _range("pixels", pixels, columns))

    def place(self, line: float, pixel: float) -> dict[str, Any]:
        """Returns ``latitude`` and ``longitude`` of a pixel [degrees]; for Sentinel-1 products also ``height`` [m], ``incidence``
        [degrees] and ``slant_range_time`` [s], for others ``None``."""
        return self._inner.place(*_pixel(line, pixel))

    def pixel_of(self, latitude: float, longitude: float) -> tuple[float, float] | None:
        """Returns line and pixel of a place [degrees], or ``None`` outside the image."""
        largest = float("inf")
        return self._inner.pixel_of(
            _check.number("latitude", latitude, -largest, largest),
            _check.number("longitude", longitude, -largest, largest),
        )

    def axes(self, line: float, pixel: float) -> dict[str, float]:
        """Returns the directions of increasing line and pixel from true north [degrees] and the spacings [m], with the keys
        ``line_azimuth``, ``pixel_azimuth``, ``line_spacing`` and ``pixel_spacing``."""
        return self._inner.axes(*_pixel(line, pixel))

    def range_to_velocity(self, line: float, pixel: float) -> float | None:
        """Returns the ratio of slant range and platform speed [s], ``radar.range_to_velocity`` of a scene; ``None`` unless the
        image is a Sentinel-1 product."""
        return self._inner.range_to_velocity(*_pixel(line, pixel))

    def locate(self, line: int, pixel: int, digital_number: float | None = None) -> dict[str, Any]:
        """Returns place, calibration and normalized radar cross-section of a pixel, from its measured value or from
        ``digital_number``."""
        given = None if digital_number is None else _check.number("digital_number", digital_number, 0.0, 1e9)
        most = 2**63 - 1
        return self._inner.locate(_check.whole("line", line, 0, most), _check.whole("pixel", pixel, 0, most), given)

    def __repr__(self) -> str:
        lines, pixels = self.shape
        return f"<Product of {lines} lines of {pixels} pixels: {self.path}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Product.open, (self.path, self._polarization)


def _range(name: str, window: slice | None, size: int) -> tuple[int, int]:
    if window is None:
        return 0, size
    if not isinstance(window, slice) or window.step not in (None, 1):
        raise TypeError(f"{name} is {window!r:.80}, expected a slice without a step")
    first = 0 if window.start is None else _check.whole(name, window.start, 0, 2**63 - 1)
    end = size if window.stop is None else _check.whole(name, window.stop, 0, 2**63 - 1)
    return first, end


def _pixel(line: float, pixel: float) -> tuple[float, float]:
    return _check.number("line", line, -1e12, 1e12), _check.number("pixel", pixel, -1e12, 1e12)
