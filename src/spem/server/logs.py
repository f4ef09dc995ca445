"""Structured logs: one line of JSON for each request, and for what else a server has to say."""

from __future__ import annotations

import json
import logging
import sys
import time
from typing import Any

NAME = "spem.server"
_log = logging.getLogger(NAME)


class JsonLines(logging.Formatter):
    """Formats a record as one line of JSON; fields come from ``extra={"fields": {...}}``."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        line: dict[str, Any] = {
            "time": f"{_timestamp(record.created)}Z",
            "level": record.levelname.lower(),
            "event": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=True, default=str)


def _timestamp(seconds: float) -> str:
    """Return a moment in UTC, to the millisecond."""
    whole = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds))
    return f"{whole}.{int(seconds % 1 * 1000):03d}"


def configure(level: int = logging.INFO) -> None:
    """Send the logs of the server, and of what it runs on, to stderr as lines of JSON."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    for name in (NAME, "uvicorn"):
        log = logging.getLogger(name)
        log.handlers[:] = [handler]
        log.propagate = False
        log.setLevel(level if name == NAME else logging.WARNING)


def tell(event: str, **fields: Any) -> None:
    """Write a line that something happened."""
    if _log.isEnabledFor(logging.INFO):
        _log.info(event, extra={"fields": fields})


def fail(event: str, error: BaseException, **fields: Any) -> None:
    """Write a line on an error that nobody foresaw, with its traceback."""
    _log.error(event, extra={"fields": fields}, exc_info=error)
