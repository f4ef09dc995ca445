"""
Section 5.1: what it costs
==========================

The paper iterated a sparse product on a graphics card of 2013: two seconds for each field of a shape of
250,000 voxels, and three for the projections of each shape of the "1000-shape" database. Here all ρ are
solved for at once, by multigrid and conjugate gradients at a few ρ and a Galerkin basis for the others, on
a processor; what is timed is the whole way from a shape to all 64 fields, each written out, and six maps.
"""

import numpy as np

import spem
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Table, judged
from spem.paper.present import present
from spem.paper.timing import N_MAPS, N_RHO, Times, time_collection, time_maps, warm_up

PER_FIELD, PER_SHAPE = 2.0, 3.0
VOXELS, PROCESSES = 250_000, 2


def make(data: Data) -> Finding:
    """Time one large shape and a collection of silhouettes."""
    warm_up()
    voxels = 15_000 if data.quick else VOXELS
    dog = spem.creatures.creature("dog", ndim=3, voxels=voxels, rng=np.random.default_rng(0))
    large = min((time_maps(dog) for _ in range(3)), key=lambda times: times.wall)
    found = data.collection("tari1000", ndim=2, per_class=1 if data.quick else None, voxels=6000)
    items = found.items[:20] if data.quick else found.items
    total, each = time_collection(items, 1 if data.quick else PROCESSES)
    numbers = {
        "nodes": dog.n_nodes,
        "wall": large.wall,
        "processor": large.processor,
        "per_field": large.wall / N_RHO,
        "silhouettes": len(each),
        "total": total,
        "median_per_silhouette": float(np.median(each)),
    }
    claims = (field_claim(dog, large, data), silhouette_claim(total, each, found.real, data))
    source = f"A creature of {dog.n_nodes} voxels. {found.source}"
    return Finding(source, claims, tables=(table_times(large, dog.n_nodes, total, each),), numbers=numbers)


def table_times(large: Times, n_nodes: int, total: float, each: list[float]) -> Table:
    """Return the times as a table."""
    several = f"{N_RHO} fields and {N_MAPS} maps, {n_nodes} nodes"
    rows = (
        (several, f"{large.wall:.2f}", f"{large.processor:.2f}"),
        ("the same, a field", f"{large.wall / N_RHO:.3f}", f"{large.processor / N_RHO:.3f}"),
        (f"maps of {len(each)} silhouettes, with reading", f"{total:.1f}", f"{sum(each):.1f}"),
        ("the same, a silhouette", f"{total / len(each):.3f}", f"{np.median(each):.3f}"),
    )
    return Table(
        "Seconds on this machine; of silhouettes, on the right, their sum over processes and the median.",
        ("what", "by the clock", "of all processors"),
        rows,
    )


def silhouette_claim(total: float, each: list[float], real: bool, data: Data) -> Claim:
    """Judge the time of one silhouette."""
    return judged(
        "The projections of each shape of the 1000-shape database take about 3 seconds (5.1).",
        f"{PER_SHAPE:g} s a shape",
        f"{np.median(each):.3f} s a shape, {len(each)} of them in {total:.1f} s by the clock",
        float(np.median(each)) < PER_SHAPE,
        note="This machine takes longer for each of them." if real else data.absent("tari1000"),
        tested=real,
    )


def field_claim(shape: spem.Shape, times: Times, data: Data) -> Claim:
    """Judge the time of one field of a large shape."""
    small = "A quick run takes a smaller shape, for which the paper gives no time."
    return judged(
        "Each field of a shape of 250,000 voxels takes 2 seconds, on a graphics card of 2013 (5.1).",
        f"{PER_FIELD:g} s a field, {N_RHO * PER_FIELD:g} s for {N_RHO}",
        f"{times.wall:.2f} s for {N_RHO} fields and {N_MAPS} maps of {shape.n_nodes} voxels, "
        f"{times.wall / N_RHO:.3f} s a field",
        times.wall < N_RHO * PER_FIELD,
        note=small if data.quick else "This machine takes longer.",
        tested=not data.quick,
    )


if __name__ == "__main__":
    finding = present(make)
