"""Products: places, pixels, and what is refused."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from shipwake import Dataset, Detector, Product, errors


@pytest.fixture
def sentinel(products: Path) -> Product:
    [path] = products.glob("S1A_IW_GRDH_1SDV_2021*.zip")
    return Product.open(path)


@pytest.fixture
def picture(tmp_path: Path, data: Dataset) -> Path:
    data.write(tmp_path / "set")
    return tmp_path / "set" / "images" / "000000.png"


def test_places_of_a_product(sentinel: Product) -> None:
    assert sentinel.is_calibrated and sentinel.has_places and not sentinel.has_pixels
    lines, pixels = sentinel.shape
    place = sentinel.place(4512, 9512)
    assert 30 < place["incidence"] < 46 and place["slant_range_time"] > 0
    line, pixel = sentinel.pixel_of(place["latitude"], place["longitude"]) or (0, 0)
    assert abs(line - 4512) < 1e-3 and abs(pixel - 9512) < 1e-3
    assert sentinel.pixel_of(0.0, 170.0) is None and sentinel.pixel_of(1e9, float("inf")) is None
    axes = sentinel.axes(4512, 9512)
    assert 9 < axes["line_spacing"] < 11 and 9 < axes["pixel_spacing"] < 11
    assert 90 < (sentinel.range_to_velocity(4512, 9512) or 0) < 140
    located = sentinel.locate(4512, 9512, digital_number=100)
    assert located["latitude"] == place["latitude"] and located["sigma0"] > 0
    assert pickle.loads(pickle.dumps(sentinel)).shape == (lines, pixels)


def test_pixels_of_a_picture(picture: Path, data: Dataset) -> None:
    product = Product.open(picture)
    assert product.shape == (32, 24) and product.has_pixels and not product.has_places and not product.is_calibrated
    levels = np.floor(255 * data[0]["image"][0] + 0.5)
    np.testing.assert_array_equal(product.read(), levels)
    np.testing.assert_array_equal(product.read(slice(3, 9), slice(20, None)), levels[3:9, 20:])
    assert Detector.pretrained().find_in(product) == []


def test_refusals(sentinel: Product, picture: Path, tmp_path: Path) -> None:
    product = Product.open(picture)
    with pytest.raises(errors.FileError):
        Product.open(tmp_path / "nowhere.SAFE")
    with pytest.raises(errors.ShipwakeError):
        Product.open(tmp_path)
    with pytest.raises(errors.ProductError):
        Product.open(__file__)
    with pytest.raises(errors.OptionError, match="VV"):
        Product.open(picture, polarization="XX")
    with pytest.raises(errors.ProductError):
        Product.open(picture, polarization="VV")
    for path in ("", "a\0b", 3, None):
        with pytest.raises(errors.OptionError):
            Product.open(path)
    with pytest.raises(errors.ProductError, match="no measurement"):
        sentinel.read(slice(0, 4), slice(0, 4))
    with pytest.raises(errors.ProductError):
        Detector.pretrained().find_in(sentinel)
    for lines in (slice(3, 3), slice(0, 33), slice(9, 3), slice(0, 2**63 - 1)):
        with pytest.raises(errors.OptionError):
            product.read(lines)
    for wrong in (slice(0, 4, 2), 3, "a"):
        with pytest.raises(TypeError):
            product.read(wrong)  # type: ignore[arg-type]
    with pytest.raises(errors.OptionError):
        product.read(slice(-3, None))
    for line in (-5, 1e9, float("nan"), "a"):
        with pytest.raises(errors.OptionError):
            sentinel.place(line, 0)  # type: ignore[arg-type]
    with pytest.raises(errors.ProductError, match="cannot be located"):
        product.place(0, 0)
    with pytest.raises(errors.OptionError):
        sentinel.locate(10**9, 0)
    with pytest.raises(errors.OptionError):
        sentinel.locate(0, 0, digital_number=-1)
    with pytest.raises(TypeError):
        Product()
