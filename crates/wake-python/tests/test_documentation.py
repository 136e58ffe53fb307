"""The examples of the documentation."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import shipwake

MODULES = ["shipwake", *(f"shipwake.{one.name}" for one in pkgutil.iter_modules(shipwake.__path__))]
NEEDS = {"shipwake.torch": "torch"}


@pytest.mark.parametrize("name", [name for name in MODULES if name != "shipwake._core"])
def test_examples_run(name: str) -> None:
    if name in NEEDS:
        pytest.importorskip(NEEDS[name], reason=f"{NEEDS[name]} is not installed: {name} is NOT tested")
    result = doctest.testmod(importlib.import_module(name))
    assert result.failed == 0


def test_everything_public_has_a_docstring() -> None:
    for name in shipwake.__all__:
        thing = getattr(shipwake, name)
        assert isinstance(thing, str | tuple | dict) or thing.__doc__, name


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder()
    counts = [len(test.examples) for name in ("scene", "simulation", "dataset", "sampler", "detector")
              for test in finder.find(importlib.import_module(f"shipwake.{name}"))]
    assert sum(counts) >= 15
