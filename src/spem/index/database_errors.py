"""What the database raises, as one line of ours."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from spem.errors import ParameterError, ReadError, SpemError

_LONGEST = 160
_NOISE = re.compile(
    r"lance error: |LanceError\(\w+\): |Invalid input, |External error: |Execution error: |"
    r",? ?/\S+\.rs:\d+(:\d+)?\S*"
)
_FULL = re.compile(r"no space left|disk quota|storage full|os error 28\b", re.IGNORECASE)
_FORBIDDEN = re.compile(
    r"permission denied|read-only file system|access ?denied|forbidden|os error (13|30)\b", re.IGNORECASE
)
_UNREACHABLE = re.compile(
    r"connect|dns|timed? ?out|NoSuchBucket|AccessKey|Signature|credential|Request|Retry|provider",
    re.IGNORECASE,
)
# What says most in the many words of object storage, best first.
_REASONS = (
    re.compile(r"<Message>(.*?)</Message>"),
    re.compile(r'message: "([^"]+)"'),
    re.compile(r"(Failed to get \w+ credentials)"),
    re.compile(r"(status: \d+)"),
    re.compile(r"(No object store provider found for scheme: '\w*')"),
)
# What the database does not raise: mistakes of ours must not pass for damage.
_NOT_ITS_OWN = (
    *(KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError, Warning),
    *(LookupError, TypeError, AttributeError, AssertionError),
)
_CONFLICT = re.compile(r"conflict|concurrent|contention|preempted|Too many", re.IGNORECASE)
# What a filter cannot bring about: bytes that are not what they should be.
_DAMAGE = re.compile(
    r"not found: |\(IO\)|corrupt|appear to be a lance|local ?file ?system|magic|panic|decod|buffer",
    re.IGNORECASE,
)


def brief(error: BaseException) -> str:
    """Return what an error of the database says, on one line and without the places in its source.

    Examples
    --------
    >>> brief(RuntimeError("lance error: file size is too small, /build/lance/utils.rs:172:20"))
    'file size is too small'
    """
    text = " ".join(_NOISE.sub("", str(error)).split()).rstrip(" .,:;")
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


@contextmanager
def told(address: str, *, writing: bool = False, where: str | None = None) -> Iterator[None]:
    """Turn what the database raises inside into an error of ours, panics included.

    Parameters
    ----------
    address
        The index, for the message.
    writing
        Whether something is being written.
    where
        The filter that is being applied, which may be what is wrong.

    Raises
    ------
    ParameterError
        When the filter has no meaning, or the index cannot be written to.
    ReadError
        When the index is damaged or cannot be reached.

    Examples
    --------
    >>> with told("shapes.db"):
    ...     raise RuntimeError("lance error: file size is too small")
    Traceback (most recent call last):
        ...
    spem.errors.ReadError: shapes.db: damaged (file size is too small); see: spem index check shapes.db
    """
    try:
        yield
    except (SpemError, *_NOT_ITS_OWN):
        raise
    # A panic of the database is a BaseException that no module exports.
    except BaseException as error:
        raise _ours(error, address, writing=writing, where=where) from error


def _ours(error: BaseException, address: str, *, writing: bool, where: str | None) -> SpemError:
    """Choose the error that says the same."""
    text, said = str(error), brief(error)
    far = "://" in address and _UNREACHABLE.search(text) is not None
    if far:
        said = next((found[1] for pattern in _REASONS if (found := pattern.search(text))), said)
    is_filter = where is not None and isinstance(error, (ValueError, RuntimeError))
    if is_filter and not far and not _DAMAGE.search(text):
        shown = brief(ValueError(where))
        msg = f"where={shown!r}: no filter of rows ({said}); write SQL such as label = 'cat' AND volume > 2"
        return ParameterError(msg)
    if isinstance(error, UnicodeEncodeError):
        return ParameterError(f"{address}: text that is no Unicode ({said}); leave these characters out")
    if _FULL.search(text):
        return ParameterError(f"{address}: no room left to write; free some and do the same again")
    if _FORBIDDEN.search(text):
        verb = "written to" if writing else "read"
        return ParameterError(f"{address}: cannot be {verb} ({said}); check its permissions")
    if writing and _CONFLICT.search(text):
        msg = f"{address}: others kept writing at the same time ({said}); do the same again"
        return ParameterError(msg)
    if far:
        return ReadError(f"{address}: cannot be reached ({said}); check address, region and keys")
    return ReadError(f"{address}: damaged ({said}); see: spem index check {address}")
