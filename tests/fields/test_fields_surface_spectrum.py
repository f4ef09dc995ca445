"""Spectra of surfaces: closed forms, order, bad meshes."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.sparse.linalg import ArpackNoConvergence

from spem.embedding.signatures import (
    heat_kernel_signature,
    scale_invariant_signature,
    wave_kernel_signature,
)
from spem.errors import ConvergenceError, ParameterError, ShapeError
from spem.fields.surface_spectrum import SurfaceSpectrum, solve_surface_spectrum
from spem.shapes.surface import Surface


def icosphere(level: int, radius: float = 1.0) -> Surface:
    """Return a triangulated sphere."""
    mesh = trimesh.creation.icosphere(level, radius)
    return Surface(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))


@pytest.fixture(scope="module")
def sphere() -> SurfaceSpectrum:
    """Return the spectrum of a unit sphere."""
    return solve_surface_spectrum(icosphere(3), 36)


def test_values_of_a_sphere_converge_with_second_order() -> None:
    """The values l(l + 1), each 2l + 1 times, are met; a quarter of the error with halved edges."""
    degree = np.repeat(np.arange(7), 2 * np.arange(7) + 1)
    errors = []
    for level in (3, 4):
        values = solve_surface_spectrum(icosphere(level), 49).values
        errors.append(np.abs(values[1:] / (degree * (degree + 1))[1:] - 1)[:24].max())
        assert np.allclose(values, degree * (degree + 1), rtol=0.015, atol=1e-9)
    assert errors[1] < errors[0] / 3.5


def test_rectangle_lets_nothing_through_its_border() -> None:
    """An open surface has the Neumann values of its shape."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 2, 41), indexing="ij"))
    number = np.arange(21 * 41).reshape(21, 41)
    a, b, c, d = (
        part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    values = solve_surface_spectrum(Surface(np.stack([x, y, 0 * x], axis=1), faces), 20).values
    exact = np.sort([np.pi**2 * (i * i + k * k / 4) for i in range(9) for k in range(9)])[:20]
    assert np.allclose(values, exact, rtol=8e-3, atol=1e-9)


def test_vectors_are_orthonormal_over_the_surface(sphere: SurfaceSpectrum) -> None:
    """Integrals of products of eigenvectors are one and zero, to what the sum over vertices leaves out."""
    products = sphere.vectors.T @ (sphere.surface.vertex_areas[:, None] * sphere.vectors)
    assert np.allclose(products, np.eye(36), atol=0.05)
    assert (sphere.ndim, sphere.n_pairs) == (2, 36)


def test_scale_changes_values_and_vectors_by_powers(sphere: SurfaceSpectrum) -> None:
    """A sphere ten million times smaller has the same spectrum in its own unit."""
    small = solve_surface_spectrum(icosphere(3, 1e-7), 36)
    assert np.allclose(small.values * 1e-14, sphere.values, rtol=1e-8, atol=1e-9)
    assert small.size == pytest.approx(sphere.size * 1e-7)


def test_signatures_of_a_sphere_are_the_same_everywhere(sphere: SurfaceSpectrum) -> None:
    """Whole eigenspaces of a sphere leave no point of it apart, in any signature."""
    for made in (
        heat_kernel_signature(sphere, [0.2, 1.0]),
        wave_kernel_signature(sphere, [2.0, 6.0]),
        scale_invariant_signature(sphere, 3, span=(2.0, 20.0))[:, :1],
    ):
        assert np.ptp(made, axis=0).max() < 0.02 * made.max()


def test_heat_of_a_sphere_is_that_of_its_closed_form(sphere: SurfaceSpectrum) -> None:
    """p_t(x, x) = Σ (2l + 1) exp(−l(l + 1) t) / 4π."""
    degree = np.arange(6)
    exact = np.sum((2 * degree + 1) * np.exp(-degree * (degree + 1) * 0.3)) / (4 * np.pi)
    assert np.allclose(heat_kernel_signature(sphere, [0.3]), exact, rtol=0.02)


def test_few_vertices_are_subdivided() -> None:
    """A tetrahedron has as many pairs as are asked for, and says how."""
    mesh = trimesh.creation.icosahedron()
    made = solve_surface_spectrum(Surface(np.array(mesh.vertices), np.array(mesh.faces, np.int64)), 30)
    assert made.values.size == 30
    assert made.surface.repairs == ("cut each face into 4: 12 vertices are fewer than 30",)


def test_faces_without_area_do_no_harm() -> None:
    """A needle with corners in line leaves the values what they are, to their number."""
    plain = icosphere(2)
    a, b, c = plain.faces[0]
    middle = (plain.vertices[a] + plain.vertices[b]) / 2
    n = len(plain.vertices)
    faces = np.concatenate([plain.faces[1:], [[a, n, c], [n, b, c], [a, b, n]]])
    needled = Surface(np.vstack([plain.vertices, middle]), faces)
    values = solve_surface_spectrum(needled, 20).values
    assert np.isfinite(values).all()
    assert np.allclose(values, solve_surface_spectrum(plain, 20).values, rtol=0.1, atol=1e-6)


def test_two_parts_have_two_constants() -> None:
    """A value is zero for each part of a surface."""
    one = icosphere(2)
    both = Surface(
        np.concatenate([one.vertices, one.vertices + 5]),
        np.concatenate([one.faces, one.faces + len(one.vertices)]),
    )
    assert np.count_nonzero(solve_surface_spectrum(both, 10).values < 1e-6) == 2


@pytest.mark.parametrize("n_pairs", [0, -1, 2.5, True])
def test_numbers_of_pairs_are_checked(n_pairs: float) -> None:
    """Pairs are counted in whole numbers from one."""
    with pytest.raises(ParameterError, match="must be a whole number of at least 1"):
        solve_surface_spectrum(icosphere(1), n_pairs)  # type: ignore[arg-type]


def test_surfaces_without_a_spectrum_are_refused(sphere: SurfaceSpectrum) -> None:
    """No surface at all, no area and lone vertices are told apart."""
    plain = icosphere(1)
    with pytest.raises(ParameterError, match="expected Surface, got tuple; take"):
        solve_surface_spectrum((plain.vertices, plain.faces), 3)  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="no area"):
        solve_surface_spectrum(Surface(0 * plain.vertices, plain.faces), 3)
    with pytest.raises(ShapeError, match="1 of 43 vertices have no face"):
        solve_surface_spectrum(Surface(np.vstack([plain.vertices, [9, 9, 9]]), plain.faces), 3)
    with pytest.raises(ParameterError, match="n_pairs=37: expected 1 to 36"):
        sphere.truncated(37)


@pytest.mark.parametrize("n_pairs", [9, 16, 36, 60, 100])
def test_every_copy_of_a_multiple_value_is_found(n_pairs: int) -> None:
    """However many pairs are asked for, there are 2l + 1 of the value l(l + 1), but of the last cut off."""
    values = solve_surface_spectrum(icosphere(3), n_pairs).values
    orders = np.arange(11)
    expected = np.repeat(orders * (orders + 1.0), 2 * orders + 1)[:n_pairs]
    assert np.allclose(values, expected, rtol=0.06, atol=1e-9)


def test_iteration_that_stops_short_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line names the shape and the number of pairs, and what to do."""

    def stop(*_: object, **__: object) -> None:
        msg = "No convergence (9 iterations, 3/29 eigenvectors converged)"
        raise ArpackNoConvergence(msg, None, None)

    monkeypatch.setattr("scipy.sparse.linalg.eigsh", stop)
    with pytest.raises(
        ConvergenceError, match=r"^cat: the eigenvalue iteration for 9 pairs failed .*mend the"
    ):
        solve_surface_spectrum(icosphere(3), 9, name="cat")
