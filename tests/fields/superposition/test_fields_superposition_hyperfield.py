"""The full hyperfield: lazy, cached within a limit, labelled, on disk and resumed."""

from __future__ import annotations

import json
import pickle
import shutil

import numpy as np
import pytest
import xarray

from spem.errors import ParameterError, ReadError, SizeError
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.sweep import Sweep
from spem.fields.superposition.blocks import Recent
from spem.fields.superposition.fields import solve_sources
from spem.fields.superposition.hyperfield import SourceHyperfield
from spem.shapes.shape import Cuts, Shape

RHO = [1.0, 4.0, np.inf]
# Room for so many fields in a quarter of the limit, where the slab has 1,200 nodes.
FIELD = 8 * 1200


class Counting:
    """A direct solver that counts factorisations, and the fields solved by each."""

    entrywise = True

    def __init__(self):
        self.solved = {}

    def prepare(self, system, shift):
        """Factor, and count."""
        factor = Direct().prepare(system, shift)
        self.solved.setdefault(shift, []).append(0)
        counts = self.solved[shift]

        class Prepared:
            nbytes = 50_000

            def solve(self, rhs):
                counts[-1] += rhs.shape[1]
                return factor.solve(rhs)

        return Prepared()

    def solve(self, system, rho):
        """Solve for the whole boundary."""
        return Direct().solve(system, rho)


@pytest.fixture
def slab() -> Sources:
    return point_sources(assemble(Shape.from_mask(np.ones((30, 40)), name="slab")))


@pytest.fixture
def brick() -> SourceHyperfield:
    """A small hyperfield with every kind of attribute a shape has."""
    cuts = Cuts(np.array([0]), np.array([0], np.uint8), np.array([0.3]))
    shape = Shape.from_mask(
        np.ones((3, 4)), (0.5, 2.0), origin=(7.0, -1.0), name="brick", cuts=cuts, affine=np.eye(3)
    )
    return SourceHyperfield(point_sources(assemble(shape)), RHO)


def test_nothing_is_solved_unasked(slab):
    """Making, labelling, slicing and printing solve nothing; looking at one field solves its block alone."""
    solver = Counting()
    hyperfield = SourceHyperfield(slab, RHO, solver=solver)
    labelled = hyperfield.to_xarray()
    part = labelled.sel(rho=4.0).isel(source=[3, 130])
    assert "values with dtype=float64" in repr(labelled)
    assert str(hyperfield) == "SourceHyperfield('slab', 3 rho 1 to inf, 140 sources, 1200 nodes)"
    assert solver.solved == {}
    seen = part.values
    assert solver.solved == {1 / 16: [64 + 12]}
    assert np.allclose(seen, solve_sources(slab, 4.0).log[[3, 130]], rtol=1e-13, atol=1e-13)


def test_what_was_solved_is_kept(slab):
    """Asking again for fields of the same blocks solves nothing again."""
    solver = Counting()
    hyperfield = SourceHyperfield(slab, RHO, solver=solver)
    first = hyperfield.log()
    again = hyperfield.log(rho=[np.inf, 1.0], sources=slice(None, None, -1), nodes=[5, 3])
    assert solver.solved == {1.0: [140], 1 / 16: [140], 0.0: [140]}
    assert np.array_equal(again, first[[2, 0]][:, ::-1][..., [5, 3]])


def test_only_so_much_is_kept(slab):
    """Beyond its share of the memory limit, the block used least recently is solved again."""
    solver = Counting()
    hyperfield = SourceHyperfield(slab, [1.0], solver=solver, memory_limit=4 * 80 * FIELD)
    size = hyperfield.blocks.size
    assert size == 20
    first = [hyperfield.log(1.0, i) for i in range(0, 100, size)]  # five blocks, room for four
    assert solver.solved == {1.0: [5 * size]}
    assert np.array_equal(hyperfield.log(1.0, 99), hyperfield.log(1.0, np.arange(99, 100))[0])
    assert solver.solved == {1.0: [5 * size]}
    assert np.array_equal(hyperfield.log(1.0, 0), first[0])
    assert solver.solved == {1.0: [6 * size]}


def test_only_so_many_factors_are_kept(slab):
    """Factors beyond their share of the memory limit are made again, those within it are not."""
    solver = Counting()
    hyperfield = SourceHyperfield(slab, [1.0, 2.0, 4.0], solver=solver, memory_limit=4 * 120_000)
    size = hyperfield.blocks.size
    for k, rho in enumerate((1.0, 2.0, 1.0, 4.0, 2.0)):  # room for two
        hyperfield.log(rho, k * size)
    assert solver.solved == {1.0: [2 * size], 1 / 4: [size, size], 1 / 16: [size]}


def test_fields_of_all_sources_sum_to_the_field(slab):
    """Σ v^{p_i} = v (2.3) at each ρ, without holding all fields."""
    hyperfield = SourceHyperfield(slab, RHO, memory_limit=4 * 8 * FIELD)
    exact = Direct().solve(slab.system, np.array(RHO)).values.T
    assert np.allclose(hyperfield.total(), exact, rtol=1e-13)
    assert np.allclose(hyperfield.total(4.0), exact[1], rtol=1e-13)
    with pytest.raises(SizeError, match=r"slab: 3 rho x 140 sources x 1200 nodes need 3\.85 MiB, half of"):
        hyperfield.log()


def test_axes_of_one_value_vanish(brick):
    """One ρ, source or node drops its axis; several keep it, in the order given."""
    whole = brick.log()
    assert whole.shape == brick.size == (3, 14, 12)
    assert np.array_equal(brick.log(4.0), whole[1])
    assert np.array_equal(brick.log([4.0]), whole[1:2])
    assert np.array_equal(brick.log(sources=-1), whole[:, -1])
    assert np.array_equal(brick.log(np.inf, [9, 2], 7), whole[2, [9, 2], 7])
    assert np.array_equal(brick.log(sources=np.arange(14) > 8, nodes=slice(2, 9)), whole[:, 9:, 2:9])
    assert brick.log(1.0, 2, 3) == whole[0, 2, 3]
    assert brick.log(sources=[]).shape == (3, 0, 12)
    assert np.array_equal(brick.values(1.0), np.exp(whole[0]))
    assert np.array_equal(brick.fields(4.0).log, whole[1])


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"rho": 3.0}, "rho=3: brick is sampled at 3 from 1 to inf"),
        ({"rho": -1.0}, "rho=-1: expected a positive length"),
        ({"sources": 14}, "sources=14: expected numbers from 0 to 13"),
        ({"nodes": [0, 12]}, r"nodes=\[0, 12\]: expected numbers from 0 to 11"),
        ({"sources": 1.5}, "sources=1.5: expected numbers"),
        ({"sources": slice("a")}, "sources=slice.*: expected numbers"),
        ({"sources": [[0, 1], [2, 3]]}, r"sources of shape \(2, 2\): expected one number"),
    ],
)
def test_what_is_not_there_is_refused(brick, asked, message):
    """A ρ that is not sampled and numbers out of range are named."""
    with pytest.raises(ParameterError, match=message):
        brick.log(**asked)


def test_labels_are_those_of_the_shape(brick):
    """The labelled form has ρ, the place of each source and node, and what it holds."""
    labelled, values = brick.to_xarray(), brick.to_xarray(log=False)
    assert labelled.dims == ("rho", "source", "node")
    assert np.array_equal(labelled.rho, RHO)
    position = np.stack([labelled.source_x0, labelled.source_x1], axis=1)
    assert np.array_equal(position, brick.sources.position)
    assert np.array_equal(np.stack([labelled.x0, labelled.x1], axis=1), brick.shape.points)
    assert labelled.attrs == {"boundary": "surface", "spacing": (0.5, 2.0), "quantity": "log v"}
    assert np.array_equal(labelled.values, brick.log())
    assert np.array_equal(values.sel(rho=4.0, source=3), brick.values(4.0, 3))
    assert np.array_equal(
        labelled.where(labelled.x0 < 7.6, drop=True)[:, ::5], brick.log(nodes=range(8))[:, ::5]
    )


def test_copies_and_pickles_solve_nothing(slab):
    """A labelled array may be copied and sent to another process; what was solved stays behind."""
    hyperfield = SourceHyperfield(slab, RHO)
    labelled = hyperfield.to_xarray()
    seen = labelled[1, 5].values
    assert np.array_equal(labelled.copy(deep=True)[1, 5], seen)
    again = pickle.loads(pickle.dumps(hyperfield))  # noqa: S301
    assert np.array_equal(again.log(4.0, 5), seen)


def test_values_of_a_solver_that_is_not_right_in_every_entry(slab):
    """Conjugate gradients give fields and their sum; logarithms are refused."""
    hyperfield = SourceHyperfield(slab, [4.0], solver=ConjugateGradient())
    exact = SourceHyperfield(slab, [4.0])
    assert np.allclose(hyperfield.values(4.0, [0, 70]), exact.values(4.0, [0, 70]), atol=1e-9)
    assert np.allclose(hyperfield.to_xarray(log=False)[0, 7], exact.values(4.0, 7), atol=1e-9)
    for call in (hyperfield.log, hyperfield.to_xarray, lambda: hyperfield.fields(4.0)):
        with pytest.raises(
            ParameterError, match=r"slab: these fields are right only relative .* with Direct"
        ):
            call()


def test_bad_hyperfields_are_refused(slab):
    """A solver for the whole boundary, a wrong ρ, and a limit below a few fields."""
    with pytest.raises(ParameterError, match="solver=Sweep: solves for the whole boundary only"):
        SourceHyperfield(slab, RHO, solver=Sweep())
    with pytest.raises(ParameterError, match="rho=0: expected a positive length"):
        SourceHyperfield(slab, [0.0, 1.0])
    with pytest.raises(SizeError, match=r"slab: .* memory_limit="):
        SourceHyperfield(slab, RHO, memory_limit=10_000)


def test_what_is_larger_than_the_room_is_kept_alone():
    """The value made last is returned again even where it is larger than all the room."""
    recent = Recent(10, len)
    assert recent.get(1, lambda: "x" * 50) is recent.get(1, lambda: "y")
    recent.get(2, lambda: "z")
    assert recent.keys == (2,)


def test_zarr_round_trip(brick, tmp_path):
    """What is read back is what was written: shape, sources and fields, without a solver."""
    grouped = Sources(brick.sources.system, brick.sources.points, brick.sources.group // 3 - 1)
    for hyperfield in (brick, SourceHyperfield(grouped, RHO)):
        hyperfield.save(tmp_path / "f.zarr")
        hyperfield.save(tmp_path / "f.zarr")  # a second time replaces the first
        again = SourceHyperfield.load(tmp_path / "f.zarr")
        assert np.array_equal(again.log(), hyperfield.log())
        assert np.array_equal(again.sources.rhs.toarray(), hyperfield.sources.rhs.toarray())
        assert np.array_equal(again.shape.points, brick.shape.points)
        assert np.array_equal(again.shape.affine, np.eye(3))
        assert again.shape.report == brick.shape.report
        assert np.array_equal(again.to_xarray().sel(rho=4.0, source=1), hyperfield.log(4.0, 1))
        again.save(tmp_path / "f.zarr")  # over the one that it reads
        assert np.array_equal(SourceHyperfield.load(tmp_path / "f.zarr").log(), hyperfield.log())
    assert [p.name for p in tmp_path.iterdir()] == ["f.zarr"]


def test_xarray_opens_the_store(brick, tmp_path):
    """The stored fields are labelled by ρ, source and node without spem."""
    brick.save(tmp_path / "f.zarr")
    with xarray.open_zarr(tmp_path / "f.zarr", consolidated=False) as stored:
        assert stored["fields"].dims == ("rho", "source", "node")
        assert stored["hashes"].dims == ("rho", "block", "byte")
        assert np.array_equal(stored["fields"].sel(rho=4.0), brick.log(4.0))


def test_stores_without_names_of_dimensions_load(brick, tmp_path):
    """What was written before dimensions had names is read as ever."""
    brick.save(tmp_path / "f.zarr")
    described = list((tmp_path / "f.zarr").glob("*/zarr.json"))
    for file in described:
        head = json.loads(file.read_text())
        del head["dimension_names"]
        file.write_text(json.dumps(head))
    assert len(described) > 4
    assert np.array_equal(SourceHyperfield.load(tmp_path / "f.zarr").log(), brick.log())


def test_plain_values_are_stored_as_such(slab, tmp_path):
    """Fields that have no trusted logarithms have none when they are read back."""
    few = slab.select([0, 9])
    SourceHyperfield(few, [4.0], solver=ConjugateGradient()).save(tmp_path / "f.zarr")
    again = SourceHyperfield.load(tmp_path / "f.zarr")
    assert np.allclose(again.values(4.0), SourceHyperfield(few, [4.0]).values(4.0), atol=1e-9)
    with pytest.raises(ParameterError, match="right only relative to their maximum"):
        again.log()


def test_a_stopped_save_continues(slab, tmp_path):
    """Blocks that a stopped save wrote are not solved again; one of other fields begins anew."""
    solver, target = Counting(), tmp_path / "f.zarr"

    def stop(stage, done, total):
        if done >= 300:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        SourceHyperfield(slab, RHO, solver=solver).save(target, progress=stop)
    assert not target.exists()
    shutil.copytree(tmp_path / "f.zarr.part", tmp_path / "g.zarr.part")
    again, calls = Counting(), []
    SourceHyperfield(slab, RHO, solver=again).save(target, progress=lambda *call: calls.append(call))
    assert solver.solved == {1.0: [140], 1 / 16: [140], 0.0: [64]}
    assert again.solved == {0.0: [76]}
    assert calls[0] == ("fields", 64, 420)
    assert calls[-1] == ("fields", 420, 420)
    assert np.array_equal(SourceHyperfield.load(target).log(), SourceHyperfield(slab, RHO).log())
    other = SourceHyperfield(slab.select([0, 1]), RHO)
    other.save(tmp_path / "g.zarr")
    assert np.array_equal(SourceHyperfield.load(tmp_path / "g.zarr").log(), other.log())


def test_saving_never_replaces_anything_else(brick, tmp_path):
    """A folder or file that is no hyperfield over sources stays as it is."""
    folder, file = tmp_path / "precious", tmp_path / "thesis.txt"
    folder.mkdir()
    file.write_text("years")
    (folder / "more.txt").write_text("of work")
    for target in (folder, file):
        with pytest.raises(ReadError, match="hyperfield over sources"):
            brick.save(target)
    assert (folder / "more.txt").read_text() == "of work"
    assert file.read_text() == "years"


@pytest.mark.parametrize("harm", ["delete", "shorten", "flip"])
@pytest.mark.parametrize("array", ["fields/c/1/0/0", "voxels/c/0", "hashes/c/1/0/0"])
def test_damage_is_found(brick, tmp_path, array, harm):
    """A chunk that is lost, cut short or changed in one bit is no field."""
    target = tmp_path / "f.zarr"
    brick.save(target)
    chunk = target / array
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    if harm == "delete":
        chunk.unlink()
    else:
        chunk.write_bytes(data[:-5] if harm == "shorten" else data)
    with pytest.raises(ReadError, match="the hyperfield is damaged"):
        SourceHyperfield.load(target).log(4.0, 2)


def test_reading_what_is_no_hyperfield(tmp_path):
    """A missing group and one of another kind get one clear line."""
    with pytest.raises(ReadError, match="no hyperfield over sources there"):
        SourceHyperfield.load(tmp_path / "missing.zarr")
    import zarr

    zarr.open_group(tmp_path / "other.zarr", mode="w")
    with pytest.raises(ReadError, match="expected a hyperfield over sources of format 1, found None"):
        SourceHyperfield.load(tmp_path / "other.zarr")


@pytest.mark.parametrize(
    ("key", "value"),
    [("boundary", "voxel"), ("spacing", [1.0, 7.0]), ("log", False), ("grid", [10**6, 10**6])],
)
def test_changed_attributes_are_damage(brick, tmp_path, key, value):
    """What is told of a hyperfield beside its arrays is sealed with them."""
    path = tmp_path / "brick.zarr"
    brick.save(path)
    about = json.loads((path / "zarr.json").read_text())
    about["attributes"][key] = value
    (path / "zarr.json").write_text(json.dumps(about))
    with pytest.raises(ReadError, match=r"brick\.zarr: the hyperfield is damaged"):
        SourceHyperfield.load(path)


def test_attributes_that_are_none_are_no_hyperfield(brick, tmp_path):
    """A file of another format in the place of the group's is refused."""
    brick.save(tmp_path / "brick.zarr")
    (tmp_path / "brick.zarr" / "zarr.json").write_text("[1, 2]")
    with pytest.raises(ReadError, match="no hyperfield over sources there"):
        SourceHyperfield.load(tmp_path / "brick.zarr")


def test_one_writer_at_a_time(brick, tmp_path):
    """A second save to one place is refused while the first goes on, and leaves it whole."""
    path = tmp_path / "deep" / "brick.zarr"

    def again(*_):
        with pytest.raises(ParameterError, match="is being written by another process"):
            brick.save(path)

    brick.save(path, progress=again)
    assert np.array_equal(SourceHyperfield.load(path).log(), brick.log())
    assert [p.name for p in path.parent.iterdir()] == ["brick.zarr"]


def test_where_nothing_can_be_written(brick, tmp_path):
    """A file in the place of a folder is told of in one line."""
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match=r"brick\.zarr: cannot be written"):
        brick.save(tmp_path / "file" / "brick.zarr")


def test_the_callers_rho_may_change_later(brick):
    """The sampled ρ are the hyperfield's own."""
    rho = np.array([1.0, 2.0])
    hyperfield = SourceHyperfield(brick.sources, rho)
    rho[0] = 5.0
    assert hyperfield.rho.tolist() == [1.0, 2.0]


def test_no_room_for_a_field(brick):
    """The limit that is told is the one that was given, not the share of it in use."""
    with pytest.raises(SizeError, match=r"at a time needs .*, the limit is 100 bytes"):
        SourceHyperfield(brick.sources, [1.0], memory_limit=100)
