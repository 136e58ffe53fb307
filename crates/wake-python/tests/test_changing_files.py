"""Files that another process changes while they are read or written: every call ends with a result or with one of the package's
errors, never with a panic, a hang or a dead interpreter. ``SHIPWAKE_SECONDS`` sets how long each kind of file is tried."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import random
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import shipwake
from shipwake import Dataset, Detector, Product, Sampler, Scene, errors

SECONDS = float(os.environ.get("SHIPWAKE_SECONDS", "1"))
# A call takes at most a few seconds: a test that takes longer hangs.
HANGS = 300 + 2 * SECONDS
ASSETS = Path(__file__).parents[2]


WAYS = ("whole", "whole", "whole", "shorter", "emptied", "bits", "zeros", "longer", "renamed", "gone", "folder")


def spoil(path: Path, whole: bytes, chance: random.Random) -> None:
    """Changes a file in one of the ways in which others do, or makes it whole again."""
    start, end = sorted(chance.randrange(len(whole) + 1) for _ in range(2))
    kind = chance.choice(WAYS)
    if path.is_dir():
        path.rmdir()
    if kind == "gone":
        path.unlink(missing_ok=True)
    elif kind == "folder":
        path.unlink(missing_ok=True)
        path.mkdir()
    elif kind == "renamed":
        other = path.with_name("other")
        other.write_bytes(whole[:end])
        other.replace(path)
    elif kind == "whole" or not path.exists():
        path.write_bytes(whole)
    elif kind in ("shorter", "emptied"):
        os.truncate(path, end if kind == "shorter" else 0)
    elif kind == "longer":
        with path.open("ab") as file:
            file.write(whole[start:end])
    else:
        with path.open("r+b") as file:
            file.seek(start)
            file.write(bytes(end - start) if kind == "zeros" else chance.randbytes(min(64, end - start)))


def spoil_all(files: dict[Path, bytes], seed: int) -> None:
    """Changes files at random until the process is ended, or the one that started it."""
    chance = random.Random(seed)
    names, parent = list(files), os.getppid()
    while os.getppid() == parent:
        path = chance.choice(names)
        with suppress(OSError):
            spoil(path, files[path], chance)
        time.sleep(chance.random() * 0.004)


@contextmanager
def changing(files: list[Path]) -> Iterator[None]:
    """Another process changes the files meanwhile. If this takes too long, the interpreter is ended, even in the middle of Rust."""
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=spoil_all, args=({path: path.read_bytes() for path in files}, 5), daemon=True)
    process.start()
    faulthandler.dump_traceback_later(HANGS, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
        process.kill()
        process.join()


def tried(files: list[Path], call: Callable[[], object]) -> None:
    """Calls while the files change."""
    calls = refused = 0
    with changing(files):
        until = time.monotonic() + SECONDS
        while time.monotonic() < until or calls < 2:
            calls += 1
            try:
                call()
            except errors.InternalError as error:
                raise AssertionError(str(error)) from error
            except errors.ShipwakeError as error:
                assert str(error)
                refused += 1
    print(f"{calls} calls, {refused} errors")


def copied(source: Path, folder: Path) -> Path:
    return Path(shutil.copy(source, folder))


def read(path: Path) -> None:
    product = Product.open(path)
    if product.has_pixels:
        product.read()
    if product.has_places:
        product.place(1.0, 1.0)
    if product.is_calibrated:
        product.locate(1, 1, 100.0)


@pytest.mark.parametrize("name", ["gdal/tiles_lzw_float.tif", "gdal/strips_packbits.tif", "S1A_IW_GRDH_1SDV_20150222T170750*.zip"])
def test_products(products: Path, tmp_path: Path, name: str) -> None:
    [source] = products.glob(name)
    path = copied(source, tmp_path)
    tried([path], lambda: read(path))


def test_images(tmp_path: Path, data: Dataset) -> None:
    data.write(tmp_path / "set")
    path = tmp_path / "set" / "images" / "000000.png"
    tried([path], lambda: read(path))


def test_weights(tmp_path: Path) -> None:
    path = copied(ASSETS / "wake-detector" / "assets" / "detector.safetensors", tmp_path)
    tried([path], lambda: Detector.load(path))


def test_models(tmp_path: Path) -> None:
    for file in (ASSETS / "wake-ldm" / "assets").iterdir():
        copied(file, tmp_path)
    tried([tmp_path / "prior.safetensors"], lambda: Sampler.from_folder(tmp_path))


def test_scenes_and_recipes(tmp_path: Path, scene: Scene, data: Dataset) -> None:
    scene_file, recipe = tmp_path / "scene.toml", tmp_path / "recipe.toml"
    scene_file.write_text(scene.to_toml())
    recipe.write_text(data.recipe)
    tried([scene_file], lambda: Scene.read(scene_file))
    tried([recipe], lambda: Dataset(recipe))


def test_sets_that_are_written_and_joined(tmp_path: Path, data: Dataset) -> None:
    whole, shards = tmp_path / "whole", tmp_path / "shards"
    data.write(whole)
    for number in range(2):
        data.write(shards, shard=(number, 2))

    def files(folder: Path) -> list[Path]:
        return [file for file in sorted(folder.rglob("*")) if file.is_file()]

    def contents(folder: Path) -> dict[str, bytes]:
        return {str(file.relative_to(folder)): file.read_bytes() for file in files(folder)}

    expected = contents(whole)

    def write() -> None:
        shutil.rmtree(tmp_path / "set", ignore_errors=True)
        with suppress(OSError):
            shutil.copytree(whole, tmp_path / "set")
        data.write(tmp_path / "set")

    def merge() -> None:
        shutil.rmtree(tmp_path / "copy", ignore_errors=True)
        with suppress(OSError):
            shutil.copytree(shards, tmp_path / "copy")
        shipwake.merge_shards(tmp_path / "copy")

    shutil.copytree(whole, tmp_path / "set")
    shutil.copytree(shards, tmp_path / "copy")
    tried(files(tmp_path / "set"), write)
    tried(files(tmp_path / "copy"), merge)
    assert contents(whole) == expected
    # Left alone, both go on to the whole set.
    for call, name in ((write, "set"), (merge, "copy")):
        call()
        assert contents(tmp_path / name) == expected


def test_spoiled_files_differ(tmp_path: Path) -> None:
    """Every way to spoil a file leaves something that the next one can start from."""
    chance = random.Random(1)
    path = tmp_path / "file"
    path.write_bytes(b"")
    seen: set[bytes | bool] = set()
    for _ in range(400):
        spoil(path, b"some bytes of a file", chance)
        seen.add(path.read_bytes() if path.is_file() else path.is_dir())
    assert len(seen) > 50
