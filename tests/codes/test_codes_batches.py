"""Shapes in batches: codes of a device against those of the host, and batches against shapes alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from backends import ALL, DEVICES, needs_simulator, use_device
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from simulator import Simulated, SimulatedRuntime
from simulator.runtime import Order

import spem
from spem.codes.batch_codes import batch_codes, batch_features
from spem.codes.batches import batches, encode_shapes, features_of, part_codes
from spem.codes.features import swept_rho
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ConvergenceError, MissingExtraError, ModelError, ParameterError, ShapeError, SizeError
from spem.fields.operator import System, assemble
from spem.fields.solvers.batch import Batch
from spem.fields.solvers.engine import SourceEngine
from spem.fields.solvers.host import Host
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Shape

SETTINGS = Settings(features="spem", voxels=None, n_centers=8, n_maps=4)


@dataclass(frozen=True)
class Small:
    """A backend with little memory, that notes how many systems it was asked to hold."""

    inner: Any
    most: int
    asked: list[int] = field(default_factory=list)

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> SourceEngine:
        """Refuse more nodes than it has memory for."""
        self.asked.append(len(systems))
        nodes = sum(system.n_nodes for system in systems)
        if nodes > self.most:
            message = f"{nodes} nodes do not fit"
            raise SizeError(message)
        return self.inner.open(systems, dtype)


@pytest.fixture(scope="module")
def shapes() -> list[Shape]:
    """Return three silhouettes of different sizes."""
    y, x = np.mgrid[-16:17, -16:17]
    return [
        Shape.from_mask((x / (6 + 3 * i)) ** 2 + (y / (14 - 2 * i)) ** 2 < 1, name=f"e{i}") for i in range(3)
    ]


@pytest.fixture(scope="module")
def others() -> list[Shape]:
    """Return silhouettes to learn from: those that are coded have no node right at a cut between levels."""
    return [spem.synthetic.star_polygon(5, 2, spacing=0.05), spem.synthetic.box((11.0, 17.0), 0.77)]


@pytest.fixture(scope="module")
def model(others: list[Shape]) -> Model:
    """Return what is learnt from the others."""
    return learn(others, SETTINGS)


def learn(shapes: list[Shape], settings: Settings) -> Model:
    """Learn a model on the host."""
    return Model.fit(settings, features_of(shapes, settings, device=Host()), shapes[0].ndim)


def ready(shape: Shape) -> tuple[System, NDArray[np.float64]]:
    """Return what a sweep takes."""
    return assemble(shape), swept_rho(shape, SETTINGS)


@given(st.lists(st.integers(1, 3000), max_size=12), st.integers(300, 6000))
def test_batches_are_whole_and_no_larger_than_wanted(counts: list[int], most: int) -> None:
    """Every shape is in one batch, in order, and only one shape by itself may be larger than a batch."""
    found = batches(counts, most)
    assert [place for places in found for place in places] == list(range(len(counts)))
    for places in found:
        assert len(places) == 1 or sum(counts[place] + 256 for place in places) <= most


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    "settings",
    [
        Settings(features="spem", voxels=None, n_centers=16),
        Settings.paper(voxels=None, n_centers=8),
        Settings(features="spem", voxels=None, n_centers=8, n_maps=5, rho_ranges=[(0.03, 0.1), (0.05, 0.3)]),
    ],
    ids=["default", "paper", "two bands"],
)
def test_codes_are_those_of_the_host(
    device: str, shapes: list[Shape], others: list[Shape], settings: Settings
) -> None:
    """Codes agree to 1e-4: levels, nodes off the boundary, bands."""
    model = learn(others, settings)
    host, found = (encode_shapes(shapes, model, device=each) for each in (Host(), use_device(device)))
    assert np.linalg.norm(host - found, axis=1).max() < 1e-4


@pytest.mark.parametrize("device", DEVICES)
def test_codes_of_solids_are_those_of_the_host(device: str) -> None:
    """Solids are coded alike."""
    solids = [spem.synthetic.ball(1.0, 0.16), spem.synthetic.ball(1.0, 0.19)]
    model = learn([spem.synthetic.box((1.0, 1.5, 2.0), 0.17)], SETTINGS)
    host, found = (encode_shapes(solids, model, device=each) for each in (Host(), use_device(device)))
    assert np.linalg.norm(host - found, axis=1).max() < 1e-4


def test_host_as_a_device_changes_nothing(shapes: list[Shape]) -> None:
    """On the host batches give the features of each shape alone, bit by bit."""
    for shape, bands in zip(shapes, features_of(shapes, SETTINGS, device=Host()), strict=True):
        np.testing.assert_array_equal(bands[0], shape_features(shape, SETTINGS)[0])


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("order", ["backward", "shuffled"])
def test_neither_batch_nor_order_changes_a_bit(
    device: str, shapes: list[Shape], model: Model, order: Order
) -> None:
    """A shape has the same features and code alone as in a batch, in any order of blocks and threads."""
    other, first = use_device(device, order), use_device(device)
    together = encode_shapes(shapes, model, device=other)
    features = features_of(shapes[::-1], SETTINGS, device=other)[::-1]
    for shape, code, bands in zip(shapes, together, features, strict=True):
        np.testing.assert_array_equal(encode_shapes([shape], model, device=first)[0], code)
        np.testing.assert_array_equal(features_of([shape], SETTINGS, device=first)[0][0], bands[0])


@pytest.mark.parametrize("device", DEVICES)
def test_joined_codes_have_the_other_kinds_of_the_host(
    device: str, shapes: list[Shape], others: list[Shape]
) -> None:
    """Of several kinds only SPEM maps are made on the device."""
    settings = Settings(features="spem+sources", voxels=None, n_centers=8)
    model = learn(others, settings)
    features = features_of(shapes, settings, device=use_device(device))
    np.testing.assert_array_equal(features[1][1], shape_features(shapes[1], settings)[1])
    host, found = (encode_shapes(shapes, model, device=each) for each in (Host(), use_device(device)))
    assert np.linalg.norm(host - found, axis=1).max() < 1e-4


# In the simulator this would take a second; engines halve batches there.
@pytest.mark.parametrize("name", [ALL[0], ALL[-1]])
def test_want_of_memory_halves_a_batch(name: str, shapes: list[Shape], model: Model) -> None:
    """A batch that does not fit is halved, down to one shape, and codes stay the same."""
    inner = Host() if name == "host" else use_device(name)
    device = Small(inner, 700)
    codes = encode_shapes([*shapes, *shapes], model, device=device)
    np.testing.assert_array_equal(codes, encode_shapes([*shapes, *shapes], model, device=inner))
    assert device.asked[0] == 6
    assert min(device.asked) == 1


def test_single_shape_that_does_not_fit_fails_with_its_sizes(shapes: list[Shape], model: Model) -> None:
    """Nothing is computed elsewhere: the shape fails with the reason of the device, others do not."""
    device = Small(Host(), 300)
    outcomes = list(part_codes(shapes, model.parts[0], device=device))
    assert [isinstance(each, SizeError) for each in outcomes] == [shape.n_nodes > 300 for shape in shapes]
    with pytest.raises(SizeError, match="nodes do not fit"):
        encode_shapes(shapes, model, device=device)


@needs_simulator
def test_maps_that_do_not_fit_beside_fields_are_a_size_error(shapes: list[Shape], model: Model) -> None:
    """Memory that runs out after the sweep is told with what took it."""
    runtime = SimulatedRuntime()

    def full(*_: object) -> None:
        raise runtime.memory_errors[0]

    with Sweep(device=Simulated()).batch(*zip(*map(ready, shapes), strict=True)) as batch:
        batch.engine.project = full
        kept = [np.ones(shape.n_nodes, bool) for shape in shapes]
        message = r"maps of 3 shapes of [\d,]+ nodes do not fit on the simulator beside their fields"
        with pytest.raises(SizeError, match=message):
            batch_codes(batch, model.parts[0], kept)
        with pytest.raises(SizeError, match=message):
            batch_features(batch, SETTINGS, kept)


@needs_simulator
def test_maps_that_are_not_finite_are_refused(shapes: list[Shape], model: Model) -> None:
    """Codes are never made of what is no number."""
    with Sweep(device=Simulated()).batch(*zip(*map(ready, shapes[:1]), strict=True)) as batch:
        true = batch.engine.project
        batch.engine.project = lambda constant, mix: true(constant * np.nan, mix)
        [error] = batch_codes(batch, model.parts[0], [np.ones(shapes[0].n_nodes, bool)])
    assert isinstance(error, ParameterError)
    assert str(error) == "the maps of e0 contain NaN or inf; they must be finite"


def test_batches_follow_each_other(shapes: list[Shape], model: Model) -> None:
    """Codes keep the order of the shapes over several batches."""
    device = Small(Host(), 10_000)
    codes = encode_shapes(shapes, model, device=device, max_nodes=300)
    np.testing.assert_array_equal(codes, encode_shapes(shapes, model, device=Host()))
    assert device.asked == [1, 1, 1]


def test_missing_device_is_told_at_once(shapes: list[Shape], model: Model) -> None:
    """What is wrong with the device is no failure of a shape."""

    class Missing:
        """A device that needs what is not installed."""

        def open(self, *_: object) -> SourceEngine:
            """Refuse."""
            message = "no such package"
            raise MissingExtraError(message)

    with pytest.raises(MissingExtraError, match="no such package"):
        list(part_codes(shapes, model.parts[0], device=Missing()))


@needs_simulator
def test_sweep_that_misses_its_tolerance_costs_one_shape(
    shapes: list[Shape], model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shape that did not converge is an error as a value; others of its batch have codes."""
    true = Batch.require

    def require(batch: Batch, index: int) -> None:
        true(batch, index)
        if batch.systems[index].shape.name == "e1":
            message = "e1: not converged"
            raise ConvergenceError(message)

    monkeypatch.setattr(Batch, "require", require)
    outcomes = list(part_codes(shapes, model.parts[0], device=Simulated()))
    assert [isinstance(each, ConvergenceError) for each in outcomes] == [False, True, False]


def test_shape_without_inner_nodes_is_an_error_as_a_value(shapes: list[Shape]) -> None:
    """What cannot be swept does not keep others from it, and is raised where all are wanted."""
    settings = Settings.paper(voxels=None, n_centers=4)
    bar = Shape.from_mask(np.ones((1, 9)), name="bar")
    part = learn(shapes, settings).parts[0]
    outcomes = list(part_codes([shapes[0], bar, shapes[1]], part, device=Host()))
    assert [isinstance(each, ShapeError) for each in outcomes] == [False, True, False]
    with pytest.raises(ShapeError, match="bar: every node is next to the boundary"):
        features_of([bar], settings, device=Host())


def test_other_dimensions_are_refused(model: Model) -> None:
    """A model codes shapes of its own dimension."""
    with pytest.raises(ModelError, match="ball: a 3-D shape, but the vocabulary is of 2-D ones"):
        encode_shapes([spem.synthetic.ball(1.0, 0.3)], model, device=Host())


def test_shapes_of_several_dimensions_are_refused(shapes: list[Shape]) -> None:
    """A batch is of one dimension."""
    with pytest.raises(ParameterError, match="shapes of dimensions 2, 3; give shapes of one dimension"):
        features_of([shapes[0], spem.synthetic.ball(1.0, 0.3)], SETTINGS, device=Host())


@pytest.mark.parametrize("device", DEVICES)
def test_maps_of_an_interval(device: str) -> None:
    """Shapes of one dimension have the maps of the host."""
    shape = spem.synthetic.interval(1.0, 0.01)
    backends = Host(), use_device(device)
    [[host]], [[found]] = (features_of([shape], SETTINGS, device=each) for each in backends)
    assert np.abs(host - found).max() < 1e-5 * np.abs(host).max()


def test_no_shapes_have_no_codes(model: Model) -> None:
    """Nothing in, nothing out."""
    assert encode_shapes([], model, device=Host()).shape == (0, model.n_code)
    assert features_of([], SETTINGS, device=Host()) == []
