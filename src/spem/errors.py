"""The exceptions of spem; catch `SpemError` to catch them all.

    SpemError
    ├── ReadError           a file that cannot be read as a shape, a model or codes
    ├── ShapeError          a shape that cannot carry a field
    ├── SizeError           a grid or an image over the memory limit
    ├── ParameterError      an argument out of its range (also a ValueError)
    ├── LabelError          labels that do not fit the shapes they label
    ├── ModelError          codes, a vocabulary or a query that do not belong together
    ├── ClusterError        a cluster that cannot be reached, or does not fit
    ├── MissingExtraError   a package of an extra that is not installed
    ├── SandboxError        a task of the server that was stopped: too long, too large, dead, cancelled
    ├── QueueFullError      a task that the server has no room for now
    └── ConvergenceError    an iteration that missed its tolerance; carries the best iterate

Each message is one line: what is wrong, where, what was expected, what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


class SpemError(Exception):
    """Base class of every error that spem raises on purpose."""


class ReadError(SpemError):
    """A file that is missing, empty, truncated or of a kind that spem cannot read.

    Parameters
    ----------
    message
        One line: which file, what is wrong with it, what to do.
    failures
        Of a collection that gave no shape at all: why each of its files did not.
    """

    def __init__(self, message: str, failures: Sequence[Any] = ()) -> None:
        super().__init__(message)
        self.failures = tuple(failures)


class ShapeError(SpemError):
    """A shape on which no field can be computed."""


class SizeError(SpemError):
    """An image or grid that would need more memory than the limit, refused before allocation."""


class ParameterError(SpemError, ValueError):
    """An argument out of its range."""


def require_kind(value: Any, kind: type, remedy: str) -> None:
    """Raise a `ParameterError` unless an argument is of the kind that is expected.

    Examples
    --------
    >>> require_kind("hand.png", dict, "read it first")
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: expected dict, got str; read it first
    """
    if not isinstance(value, kind):
        msg = f"expected {kind.__name__}, got {type(value).__name__}; {remedy}"
        raise ParameterError(msg)


class LabelError(SpemError):
    """Labels that do not fit the shapes."""


class ModelError(SpemError):
    """Codes, a vocabulary or a query that were not made by the same model."""


class ClusterError(SpemError):
    """A cluster that cannot be reached, is lost, or whose workers would not do the same as here."""


class MissingExtraError(SpemError):
    """A package that only an extra needs, and that is not installed."""


class SandboxError(SpemError):
    """A task on an untrusted file that was stopped, with the process that it ran in.

    Parameters
    ----------
    message
        One line: which task, why it was stopped, what to do.
    reason
        ``"time"``, ``"memory"``, ``"died"`` (its process crashed), ``"cancelled"``, ``"closed"`` (the server
        is going down) or ``"unexpected"`` (an error that no reader should raise).
    detail
        More for the log of the server, never for a client.
    """

    def __init__(self, message: str, reason: str = "died", detail: str = "") -> None:
        super().__init__(message)
        self.reason = reason
        self.detail = detail


class QueueFullError(SpemError):
    """A task that is refused because too many wait.

    Parameters
    ----------
    message
        One line.
    seconds
        When to try again.
    """

    def __init__(self, message: str, seconds: float = 1.0) -> None:
        super().__init__(message)
        self.seconds = seconds


class ConvergenceError(SpemError):
    """An iterative solve that missed its tolerance.

    Parameters
    ----------
    message
        One line: what was reached, what was asked, what to do.
    solution
        The outcome of the failed solve, with its best iterate, residual and iteration count.
    """

    def __init__(self, message: str, solution: Any = None) -> None:
        super().__init__(message)
        self.solution = solution
