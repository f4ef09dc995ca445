"""How far fields, maps and codes of each side are from those in double precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import spem
from _sides import N_MAPS, Processor, Side, run
from _table import Row
from spem.codes.batches import encode_shapes
from spem.codes.features import SWEEP_RTOL, node_features, sweep_bands
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.embedding.maps import compute_maps
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Shape

N_RHO = 64
# Above this many nodes a factorisation for each of a few ρ takes too long, in 2-D and in 3-D.
DIRECT_NODES = {2: 20_000, 3: 4_000}
REFERENCE_RTOL = 1e-11
FIELD_LIMIT, CODE_LIMIT = 1e-5, 1e-4


def errors(side: Side, name: str, shape: Shape, model: Model) -> Row:
    """Return worst relative errors of one shape's fields and maps, and of its code."""
    found = run(side, [shape], N_RHO, fetch=True)
    rho = sample_rho(shape.size, count=N_RHO)
    system = assemble(shape)
    exact = Sweep(rtol=REFERENCE_RTOL).hyperfield(system, rho)
    reference, some = exact.fields(), np.arange(N_RHO)
    row: Row = {
        "shape": name,
        "side": side.name,
        "nodes": shape.n_nodes,
        "reference": f"sweep to {REFERENCE_RTOL:g}",
    }
    if shape.n_nodes <= DIRECT_NODES[shape.ndim]:
        some = np.array([0, N_RHO // 2, N_RHO - 1])
        reference[:, some] = Direct().solve(system, rho[some]).values
        row["reference"] = "direct"
    row["field"] = worst(found.fields[0][:, some], reference[:, some])
    row["maps"] = worst(found.maps[0], compute_maps(exact, N_MAPS).values)
    best = codes(Processor(), [shape], model, REFERENCE_RTOL)
    row["code"] = code_error(codes(side, [shape], model), best)
    return row


def worst(values: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest difference of any column, relative to the largest value of that column."""
    off = np.abs(values.astype(np.float64) - reference).max(axis=0)
    return float((off / np.abs(reference).max(axis=0)).max())


def codes(side: Side, shapes: Sequence[Shape], model: Model, rtol: float = SWEEP_RTOL) -> np.ndarray:
    """Return the codes of shapes, fields and all, on a side."""
    return encode_shapes(shapes, model, device=side.backend(profile=False), rtol=rtol)


def code_error(values: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest distance of a code, relative to its length."""
    off = np.linalg.norm(values.astype(np.float64) - reference, axis=1)
    return float((off / np.linalg.norm(reference, axis=1)).max())


def small_model(ndim: int) -> Model:
    """Return a model learnt from a few creatures, of SPEM maps alone."""
    settings = Settings(features="spem", voxels=None)
    chance = np.random.default_rng
    made = [
        spem.creatures.creature(kind, ndim=ndim, voxels=2_000, rng=chance(7))
        for kind in ("hand", "ant", "fish")
    ]
    settings = replace(settings, n_centers=16)
    return Model.fit(settings, [node_features(sweep_bands(s, settings), settings) for s in made], ndim)
