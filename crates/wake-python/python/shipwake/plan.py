"""Plans of simulations: computed terms, and the estimated effect of terms left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Plan", "PlannedTerm"]


@dataclass(frozen=True)
class PlannedTerm:
    """One term of the physics."""

    term: str
    """Name, as in ``model.terms`` of a scene."""
    used: bool
    """Whether the term is computed."""
    estimate: float
    """Estimated relative change of the image if the term is left out."""
    why: str
    """Reason for the choice."""


@dataclass(frozen=True)
class Plan:
    """The plan of a simulation; ``print(plan)`` shows it as a table."""

    terms: list[PlannedTerm]
    """Every term of the physics."""
    notes: list[str]
    """Notes for the user about this scene."""
    left_out: float
    """Sum of the estimates of the terms that are left out."""
    core_seconds: float
    """Estimated time on one core [s]."""
    bytes: int
    """Estimated memory [bytes]."""
    sizes: dict[str, Any] = field(repr=False)
    """Computed pixels, margins, lattices and nodes."""
    _text: str = field(repr=False)

    def __str__(self) -> str:
        return self._text

    @classmethod
    def _of(cls, plan: Mapping[str, Any]) -> Plan:
        return cls(
            terms=[PlannedTerm(**term) for term in plan["terms"]],
            notes=plan["notes"],
            left_out=plan["left_out"],
            core_seconds=plan["core_seconds"],
            bytes=plan["bytes"],
            sizes=plan["sizes"],
            _text=plan["text"],
        )
