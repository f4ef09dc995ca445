"""What a sweep costs the host beside the kernels: the answers of an engine, recorded and given again.

The answers of a few systems stand for those of many: each system of a batch is one of the few, so that the
sweep takes the same decisions and does the same small algebra, and the engine takes no time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spem.fields.operator import System
from spem.fields.solvers.engine import Products
from spem.fields.solvers.host import Host

ANSWERS = ("measure", "search", "improve", "overlaps", "append")


@dataclass
class Recorder:
    """A backend of the processor that keeps every answer of its engine."""

    answers: list[Any] = field(default_factory=list)

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> Any:
        """Make an engine that is listened to."""
        self.answers.clear()
        return _Recorded(Host().open(systems, dtype), self.answers)


class _Recorded:
    """An engine that is listened to."""

    def __init__(self, engine: Any, answers: list[Any]) -> None:
        self.engine, self.answers = engine, answers

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.engine, name)
        if name not in ANSWERS:
            return value

        def call(*arguments: Any) -> Any:
            answer = value(*arguments)
            self.answers.append(answer)
            return answer

        return call


@dataclass
class Replay:
    """A backend that gives recorded answers, of each system so many times."""

    answers: list[Any]
    times: int

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> Any:
        """Make the engine, all answers ready."""
        return _Replayed(systems, dtype, [_repeat(answer, self.times) for answer in self.answers])


class _Replayed:
    """An engine that takes no time."""

    def __init__(self, systems: Sequence[System], dtype: type[np.floating[Any]], answers: list[Any]) -> None:
        self.counts = np.array([system.n_nodes for system in systems], np.int64)
        self.units = np.array([min(system.shape.spacing) for system in systems])
        self.dtype = dtype
        self.answers = iter(answers)

    def _next(self, *_: Any) -> Any:
        return next(self.answers)

    measure = search = improve = overlaps = append = _next

    def select(self, _: Any) -> None:
        """Do nothing: all answers are there."""

    def close(self) -> None:
        """Do nothing: there is nothing to give back."""


def _repeat(answer: Any, times: int) -> Any:
    """Repeat the systems of an answer."""
    if isinstance(answer, Products):
        return Products(*(_repeat(part, times) for part in answer))
    if isinstance(answer, tuple):
        return tuple(_repeat(part, times) for part in answer)
    return np.tile(answer, (times, *[1] * (answer.ndim - 1)))
