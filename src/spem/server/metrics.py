"""Figures for Prometheus, in a registry of one app."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric

_SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 120.0)
Readings = Callable[[], Mapping[str, tuple[str, float]]]


class Metrics:
    """What is counted of requests, and what is read when somebody asks.

    Parameters
    ----------
    readings
        Called for each page of metrics: name, help and value of figures of the moment.

    Examples
    --------
    >>> metrics = Metrics(lambda: {"spem_index_shapes": ("Shapes of the index.", 24.0)})
    >>> metrics.request("GET", "/health", 200, 0.002)
    >>> "spem_index_shapes 24.0" in metrics.page().decode()
    True
    """

    def __init__(self, readings: Readings) -> None:
        self._registry = CollectorRegistry()
        self._readings = readings
        self._requests = Counter(
            "spem_requests", "Requests by method, route and status.", ("method", "route", "status"),
            registry=self._registry,
        )  # fmt: skip
        self._seconds = Histogram(
            "spem_request_seconds", "Time to answer, by route.", ("route",), buckets=_SECONDS,
            registry=self._registry,
        )  # fmt: skip
        self._running = Gauge("spem_requests_running", "Requests being answered.", registry=self._registry)
        self._registry.register(_Readings(readings))

    def begin(self) -> None:
        """Count a request that has come."""
        self._running.inc()

    def end(self) -> None:
        """Count a request that is over."""
        self._running.dec()

    def request(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request that was answered."""
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(route).observe(seconds)

    def page(self) -> bytes:
        """Return all figures as Prometheus reads them."""
        return generate_latest(self._registry)


class _Readings:
    """Collects the figures of the moment."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings

    def collect(self) -> Iterator[Metric]:
        """Yield each figure."""
        for name, (text, value) in self._readings().items():
            yield GaugeMetricFamily(name, text, value)

    def describe(self) -> Iterator[Metric]:
        """Yield nothing: names are known when they are read."""
        return iter(())
