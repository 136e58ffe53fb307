"""Compares the detector's network in onnxruntime with this program's.

    pip install onnx onnxruntime safetensors
    wake export onnx --out detector.onnx --samples samples.safetensors
    python tests/foreign/check_onnx.py detector.onnx samples.safetensors
"""

import sys

import numpy as np
import onnx
import onnxruntime
from safetensors.numpy import load_file

# Values of the maps are of order 1 to 10; both programs sum up to 2,600 products in 32 bits.
ALLOWED = 1e-4

onnx.checker.check_model(onnx.load(sys.argv[1]), full_check=True)
session = onnxruntime.InferenceSession(sys.argv[1])
samples = load_file(sys.argv[2])
largest, count = 0.0, 0
while f"inputs.{count}" in samples:
    inputs, expected = samples[f"inputs.{count}"], samples[f"maps.{count}"]
    maps = session.run(["maps"], {"inputs": inputs})[0]
    assert maps.shape == expected.shape, (maps.shape, expected.shape)
    largest = max(largest, float(np.abs(maps - expected).max()))
    count += 1
assert count == 10, count
# Several images at once give the maps of each.
both = np.concatenate([samples["inputs.0"], samples["inputs.0"][..., ::-1]])
first = session.run(["maps"], {"inputs": np.ascontiguousarray(both)})[0][:1]
assert np.abs(first - samples["maps.0"]).max() < ALLOWED
print(f"{count} images, largest difference {largest:.1e}")
assert largest < ALLOWED, largest
