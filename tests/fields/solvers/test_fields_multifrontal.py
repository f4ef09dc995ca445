"""The multifrontal factorisation: exact against dense algebra, right in every entry, honest about memory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mpmath import mp, mpf

from spem.errors import ParameterError, SizeError
from spem.fields.operator import assemble
from spem.fields.solvers.multifrontal import factorize
from spem.shapes.shape import Shape

MASKS = st.integers(1, 4).flatmap(
    lambda d: hnp.arrays(bool, hnp.array_shapes(min_dims=d, max_dims=d, max_side=30 // (d * d) + 2))
)


@settings(max_examples=40, deadline=None)
@given(mask=MASKS, shift=st.sampled_from([0.0, 1e-3, 7.0]), boundary=st.sampled_from(["surface", "voxel"]))
def test_solves_like_dense_algebra(mask, shift, boundary):
    """On random masks of one to four dimensions the solution is that of a dense solver."""
    if not mask.any():
        return
    system = assemble(Shape.from_mask(mask, tuple(1.0 + 0.3 * a for a in range(mask.ndim))), boundary)
    rhs = np.random.default_rng(0).standard_normal((system.n_nodes, 3))
    exact = np.linalg.solve(system.matrix(shift).toarray(), rhs)
    assert np.abs(factorize(system, shift).solve(rhs) - exact).max() < 1e-12 * max(np.abs(exact).max(), 1.0)


def test_one_right_hand_side_is_a_column_of_many():
    """A vector comes back as a vector, equal to the column of a block; the caller's array is unchanged."""
    factor = factorize(assemble(Shape.from_mask(np.ones((30, 20)))), 0.1)
    rhs = np.random.default_rng(1).random((600, 5))
    before = rhs.copy()
    block, single = factor.solve(rhs), factor.solve(rhs[:, 2])
    assert single.shape == (600,)
    assert np.allclose(block[:, 2], single, rtol=1e-14)
    assert np.array_equal(rhs, before)


def test_other_components_stay_exactly_zero():
    """A source in one component leaves the other at zero, not at rounding."""
    mask = np.zeros((20, 30), bool)
    mask[:, :12] = mask[:, 18:] = True
    shape = Shape.from_mask(mask)
    rhs = np.zeros(shape.n_nodes)
    rhs[0] = 1.0
    right = shape.points[:, 1] > 15
    v = factorize(assemble(shape), 0.0).solve(rhs)
    assert np.all(v[right] == 0)
    assert np.all(v[~right] > 0)


def test_every_entry_is_right_along_a_thin_bar():
    """A source at the end of a 150 x 3 x 3 bar: each value down to 1e-68 to 13 digits, against 50 digits."""
    length, width = 150, 3
    system = assemble(Shape.from_mask(np.ones((length, width, width))), "voxel")
    rhs = np.zeros((length, width, width))
    rhs[0, 1, 1] = 1.0
    v = factorize(system, 0.0).solve(rhs.ravel()).reshape(length, width, width)[:, 1, 1]
    with mp.workdps(50):
        angle = [k * mp.pi / (width + 1) for k in range(1, width + 1)]
        mode = [[mp.sin(2 * a) * mp.sin(2 * b) * 2 / (width + 1) for a in angle] for b in angle]
        rate = [[mp.acosh(3 - mp.cos(a) - mp.cos(b)) for a in angle] for b in angle]
        exact = [
            mp.fsum(
                mode[p][q] ** 2 * mp.sinh((length - i) * rate[p][q]) / mp.sinh((length + 1) * rate[p][q])
                for p in range(width)
                for q in range(width)
            )
            for i in range(length)
        ]
        error = max(abs(mpf(float(value)) / truth - 1) for value, truth in zip(v, exact, strict=True))
    assert v[-1] < 1e-68
    assert error < 1e-12


def test_more_memory_than_the_limit_is_refused_before_it_is_taken():
    """The refusal says what the factorisation takes, what the limit is and what to do."""
    system = assemble(Shape.from_mask(np.ones((30, 30, 30)), name="cube"))
    with pytest.raises(
        SizeError, match=r"cube: factoring 27000 nodes takes .* GiB, the limit is .*fewer voxels"
    ):
        factorize(system, 0.0, memory_limit=1 << 20)


def test_a_shift_beyond_numbers_is_refused():
    """1/ρ² that overflows is told as such."""
    with pytest.raises(ParameterError, match="use a larger rho"):
        factorize(assemble(Shape.from_mask(np.ones((3, 3)))), 1e400)
