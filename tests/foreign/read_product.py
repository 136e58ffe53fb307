"""Reads a simulated product with GDAL (rasterio), xarray-sentinel and sarsen's reader, and compares them.

    python3 -m venv out/venv && out/venv/bin/pip install rasterio xarray-sentinel
    out/venv/bin/python tests/foreign/read_product.py PRODUCT.SAFE WAKE

The product must be simulated on a complete annotation: xarray-sentinel needs its `swathTiming`, which the test fixtures lack. WAKE is
the program `wake`: places and sigma nought of some pixels are its answers of `wake locate --json`.
"""
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import rasterio
import xarray_sentinel

safe, wake = Path(sys.argv[1]), sys.argv[2]
(measurement,) = safe.glob("measurement/*.tiff")
with rasterio.open(measurement) as image:
    assert image.dtypes == ("uint16",), image.dtypes
    numbers = image.read(1)
    points, reference = image.gcps
    assert reference.to_epsg() == 4326, reference
    assert len(points) == 210, len(points)
with rasterio.open(safe) as product:  # GDAL's own driver for SAFE folders
    assert product.driver == "SAFE", product.driver
    assert (product.height, product.width) == numbers.shape

whole = xarray_sentinel.open_sentinel1_dataset(safe)
assert whole.attrs["product_type"] == "GRD", whole.attrs
polarization = min((name for name in whole.attrs["subgroups"] if name.count("/") == 1), key=len)
image = xarray_sentinel.open_sentinel1_dataset(safe, group=polarization)
grid = xarray_sentinel.open_sentinel1_dataset(safe, group=polarization + "/gcp")
calibration = xarray_sentinel.open_sentinel1_dataset(safe, group=polarization + "/calibration")
measured = image["measurement"].transpose("azimuth_time", "ground_range")
assert measured.shape == numbers.shape
assert np.array_equal(measured.values[:100], numbers[:100])

lines, pixels = numbers.shape
places = [(0, 0), (lines - 1, pixels - 1), (lines // 3, pixels // 2)]
told = subprocess.run(
    [wake, "locate", str(safe), "--json"] + [f"{line},{pixel}" for line, pixel in places],
    check=True, capture_output=True, text=True,
)
table = calibration["sigmaNought"]
corners = {(point.row, point.col): point for point in points}
for (line, pixel), text in zip(places, told.stdout.splitlines()):
    answer = json.loads(text)
    value = float(table.interp(line=line, pixel=pixel))
    assert abs(answer["sigma_nought_lut"] / value - 1) < 1e-6, (answer, value)
    expected = max(float(numbers[line, pixel]) ** 2 - answer["noise"], 0) / value**2
    assert abs(answer["sigma0"] - expected) < 1e-5 * max(expected, 1e-3), (answer, expected)
    if (line, pixel) == (0, 0):
        first = min(points, key=lambda point: point.row + point.col)
        assert abs(first.y - answer["latitude"]) < 1e-9 and abs(first.x - answer["longitude"]) < 1e-9
print(f"{safe.name}: {lines} x {pixels}, read alike by GDAL {rasterio.__gdal_version__} and xarray-sentinel")
