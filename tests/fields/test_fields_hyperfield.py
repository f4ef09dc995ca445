"""The low-rank hyperfield: accuracy, any ρ on demand, labels, storage."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

import spem
from spem.errors import ParameterError, ReadError
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.direct import Direct
from spem.shapes.shape import Cuts, Shape

RHO = np.linspace(2.0, 30.0, 64)


@pytest.fixture(scope="module")
def comb() -> Shape:
    """A comb: many thin parts on a thick one."""
    mask = np.zeros((60, 71), bool)
    mask[40:] = True
    for k in range(8):
        mask[:40, 9 * k : 9 * k + 4 + k % 3] = True
    return Shape.from_mask(mask, name="comb")


@pytest.fixture(scope="module")
def field(comb) -> Hyperfield:
    return spem.sweep(comb, rho=RHO)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_every_field_keeps_the_tolerance(comb, rtol):
    """The largest error of any of 64 fields is below what was asked, against a direct solution."""
    exact = Direct().solve(assemble(comb), RHO).values
    error = np.abs(spem.sweep(comb, rho=RHO, rtol=rtol).fields() - exact).max()
    assert error <= rtol


def test_reported_error_is_of_the_size_of_the_true_one(comb):
    """The estimate from true residuals is neither hopeful nor fearful by more than a small factor."""
    exact = Direct().solve(assemble(comb), RHO).values
    field = spem.sweep(comb, rho=RHO, rtol=1e-4)
    true = np.abs(field.fields() - exact).max()
    assert true / 10 < field.error < true * 10


def test_any_rho_of_the_range_on_demand(field, comb):
    """A ρ that was not sampled is as accurate as one that was, inf included."""
    rho = np.array([2.77, 11.03, 29.4, np.inf])
    assert np.abs(field.at(rho) - Direct().solve(assemble(comb), rho).values).max() < 1e-6
    assert field.at(7.7).shape == (comb.n_nodes,)


@pytest.mark.parametrize("rho", [[0.5, 1000.0], [2.0, 4.0, 8.0], np.geomspace(1, 200, 8)])
def test_few_samples_cover_their_range_too(comb, rho):
    """Between two samples far apart, a field is as accurate as at them."""
    field = spem.sweep(comb, rho=rho)
    between = np.geomspace(rho[0], rho[-1], 23)
    assert np.abs(field.at(between) - Direct().solve(assemble(comb), between).values).max() < 1e-6


def test_other_samples_of_the_same_range(field):
    """A hyperfield resampled has the fields of the new samples, and refuses those outside its range."""
    assert np.array_equal(field.resampled([3.0, 9.5]).fields(), field.at([3.0, 9.5]))
    with pytest.raises(ParameterError, match="rho=1: this hyperfield of comb covers 2 to 30"):
        field.resampled([1.0, 9.5])


def test_rho_outside_the_range_is_refused(field):
    """The low-rank form promises nothing outside its range, and says so."""
    with pytest.raises(ParameterError, match="rho=31: this hyperfield of comb covers 2 to 30"):
        field.at(31.0)


def test_rank_is_small_and_storage_single(field):
    """Sixty-four fields take some ten columns of single precision."""
    assert field.rank <= 13
    assert field.basis.dtype == np.float32


def test_infinite_rho_among_the_samples(comb):
    """ρ = inf may be swept with the others, or alone."""
    both = spem.sweep(comb, rho=[3.0, np.inf]).fields()
    assert np.array_equal(both[:, 1], np.ones(comb.n_nodes, both.dtype))
    assert np.array_equal(spem.sweep(comb, rho=[np.inf]).fields(), np.ones((comb.n_nodes, 1)))


def test_xarray_by_node_and_by_grid(field, comb):
    """Both labelled forms hold the same numbers at the same coordinates."""
    nodes, grid = field.to_xarray(), field.to_xarray(grid=True)
    assert nodes.dims == ("node", "rho")
    assert grid.dims == ("axis_0", "axis_1", "rho")
    point = {"axis_0": float(nodes.x0[100]), "axis_1": float(nodes.x1[100])}
    assert np.array_equal(grid.sel(point).values, nodes[100].values)
    assert int(np.isfinite(grid[..., 0]).sum()) == comb.n_nodes


def test_zarr_round_trip(tmp_path):
    """What is read back is what was written: shape, cuts, report and fields."""
    cuts = Cuts(np.array([0]), np.array([0], np.uint8), np.array([0.3]))
    shape = Shape.from_mask(np.ones((3, 4)), (0.5, 2.0), origin=(7.0, -1.0), cuts=cuts, affine=np.eye(3))
    field = spem.sweep(shape, rho=[1.0, 2.0, np.inf])
    field.save(tmp_path / "f.zarr")
    field.save(tmp_path / "f.zarr")  # a second time replaces the first
    again = Hyperfield.load(tmp_path / "f.zarr")
    assert np.array_equal(again.fields(), field.fields())
    assert np.array_equal(again.shape.points, shape.points)
    assert np.array_equal(again.shape.cuts.fraction, shape.cuts.fraction)
    assert again.shape.report == shape.report
    assert np.array_equal(again.shape.affine, np.eye(3))
    assert [p.name for p in tmp_path.iterdir()] == ["f.zarr"]


def test_xarray_opens_the_store(tmp_path):
    """Arrays have named dimensions, so that a store is a dataset without spem."""
    shape = Shape.from_mask(np.ones((3, 4)), affine=np.eye(3))
    field = spem.sweep(shape, rho=[1.0, 2.0])
    field.save(tmp_path / "f.zarr")
    with xarray.open_zarr(tmp_path / "f.zarr", consolidated=False) as stored:
        assert stored["basis"].dims == ("node", "column")
        assert stored["gram"].dims == ("term", "other_term")
        assert np.array_equal(stored["rho"], field.rho)
        assert dict(stored.sizes) | {"node": 12, "rho": 2, "column": field.rank} == dict(stored.sizes)


def test_saving_never_replaces_anything_else(tmp_path):
    """A folder or file that is no hyperfield stays as it is."""
    field = spem.sweep(Shape.from_mask(np.ones((3, 4))), rho=[1.0, 2.0])
    folder, file = tmp_path / "precious", tmp_path / "thesis.txt"
    folder.mkdir()
    file.write_text("years")
    (folder / "more.txt").write_text("of work")
    for target in (folder, file):
        with pytest.raises(ReadError, match="hyperfield"):
            field.save(target)
    assert (folder / "more.txt").read_text() == "of work"
    assert file.read_text() == "years"


@pytest.mark.parametrize("harm", ["delete", "shorten", "flip"])
def test_damage_is_found(tmp_path, harm):
    """A chunk that is lost, cut short or changed in one bit is no field."""
    target = tmp_path / "f.zarr"
    spem.sweep(Shape.from_mask(np.ones((9, 9))), rho=[1.0, 2.0]).save(target)
    chunk = target / "basis" / "c" / "0" / "0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    if harm == "delete":
        chunk.unlink()
    else:
        chunk.write_bytes(data[:-5] if harm == "shorten" else data)
    with pytest.raises(ReadError, match="the hyperfield is damaged"):
        Hyperfield.load(target)


def test_reading_what_is_no_hyperfield(tmp_path):
    """A missing group and a foreign one get one clear line."""
    with pytest.raises(ReadError, match="no hyperfield there"):
        Hyperfield.load(tmp_path / "missing.zarr")
    import zarr

    zarr.open_group(tmp_path / "other.zarr", mode="w")
    with pytest.raises(ReadError, match="expected a hyperfield of format 1, found None"):
        Hyperfield.load(tmp_path / "other.zarr")


def test_sampling_schemes():
    """Even in ρ, in ρ² and in log ρ; the default range scales with the shape."""
    assert np.allclose(np.diff(sample_rho(1.0, 2, 30, 8)), 4.0)
    assert np.allclose(np.diff(sample_rho(1.0, 2, 30, 8, "squared") ** 2), 128.0)
    assert np.allclose(np.diff(np.log(sample_rho(1.0, 2, 32, 5, "log"))), np.log(2))
    assert np.allclose(sample_rho(50.0), 50.0 * sample_rho(1.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"low": 5, "high": 2}, "expected finite bounds in ascending order"),
        ({"low": 1, "high": np.inf}, "expected finite bounds in ascending order"),
        ({"count": 0}, "count=0: expected at least one"),
        ({"scheme": "cubic"}, "scheme='cubic': expected one of 'linear', 'squared', 'log'"),
    ],
)
def test_bad_sampling_is_refused(arguments, message):
    """Each wrong bound, count or scheme is named."""
    with pytest.raises(ParameterError, match=message):
        sample_rho(10.0, **arguments)
