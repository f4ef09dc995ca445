"""The joined code against the nearest rivals on SHREC'11: ``python benchmarks/rivals.py``.

spectralbrain 0.1.0 at the best setting known of it: wave kernel signatures at 100 energies that all shapes
share, each z-scored over the collection, and a Fisher vector over 32 Gaussians. It gets the eigenpairs of our
solver, and like ours its vocabulary is learnt on the shapes that are searched. Shape-DNA with reweighted
values needs none. Differences of first tiers are paired: all rank the same queries. Their standard error is
by resampling the classes. Times are of one core, without reading and what is learnt once.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from _class_halves import Array, error_of_classes, first_tier
from _table import Benchmark, Row, data_root
from spem.codes.kinds import shape_features
from spem.codes.settings import Settings
from spem.fields.surface_spectrum import solve_surface_spectrum
from spem.paper.data import Data
from spem.paper.scoring import Features, Repeated, repeat, summarise
from spem.paper.systems import Described, describe_all, first_classes
from spem.retrieval.distances import correlation_distance
from spem.rivals.catalogue import make_rival
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.shape import Shape

SEEDS, N_PAIRS, N_ENERGIES, N_GAUSSIANS = 5, 100, 100, 32
QUICK_CLASSES, QUICK_EACH = 4, 5
JOINED, DNA, PEER = "SPEM+surface", "Shape-DNA (reweighted)", "spectralbrain"
# Vertices of each shape that the Gaussians are fitted to: as many as nodes of ours.
SAMPLE = 500


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("rivals", str(__doc__).splitlines()[0], argv)
    root = data_root()
    if root is None or not (root / "shrec11" / "labels.csv").is_file():
        benchmark.skip("shrec11: no labels.csv under SPEM_DATA")
        benchmark.write()
        return
    found = Data(root).collection("shrec11", ndim=3, per_class=QUICK_EACH if benchmark.quick else None)
    found = first_classes(found, QUICK_CLASSES) if benchmark.quick else found
    seeds = 1 if benchmark.quick else SEEDS
    code = Settings(features="spem+surface").resolved(3)
    kinds: dict[str, Any] = {JOINED: partial(shape_features, settings=code), DNA: make_rival(DNA).describe}
    if importlib.util.find_spec("spectralbrain") is None:
        benchmark.skip("spectralbrain: not installed (pip install spectralbrain==0.1.0, Python 3.11 or 3.12)")
    else:
        kinds[PEER] = spectrum
    known = describe_all(found.items, kinds, Settings(features="spem"))
    scored = {
        JOINED: repeat(Features(known[JOINED].values, found.labels), code, seeds),
        DNA: summarise([make_rival(DNA).compare(known[DNA].values)], found.labels),
    }
    times = {name: each.seconds for name, each in known.items()}
    if PEER in known:
        runs = [fisher_distances(known[PEER], seed) for seed in range(seeds)]
        scored[PEER] = summarise([matrix for matrix, _ in runs], found.labels)
        times[PEER] += float(np.mean([seconds for _, seconds in runs]))
    title = f"shrec11: {len(found.labels)} shapes, {len(set(found.labels))} classes"
    benchmark.table(title, [row(name, each, times[name]) for name, each in scored.items()])
    labels = np.array(found.labels)
    tiers = {name: first_tier(each.matrices, labels) for name, each in scored.items()}
    rows = [
        paired(tiers[JOINED] - tiers[name], labels) | {"against": name} for name in tiers if name != JOINED
    ]
    benchmark.table("first tier of the joined code less that of the rival, paired", rows)
    if not benchmark.quick:
        for each in rows:
            benchmark.target(f"FT ahead of {each['against']}", float(each["difference"]), 0.0, at_least=True)
    benchmark.write()


def spectrum(shape: Shape) -> tuple[Array, Array]:
    """Return the eigenpairs of the surface, scaled to unit area."""
    surface = boundary_surface(shape)
    length = surface.area**-0.5
    found = solve_surface_spectrum(replace(surface, vertices=surface.vertices * length), N_PAIRS)
    return found.values, found.vectors


def fisher_distances(known: Described, seed: int) -> tuple[Array, float]:
    """Return the distances of spectralbrain's Fisher vectors, and seconds a shape without the codebook's."""
    from spectralbrain import SpectralDecomposition, compute_wks
    from spectralbrain.statistics.analysis import fisher_vector, fit_gmm_codebook

    start = time.process_time()
    energies, width = shared_energies([values for values, _ in known.values])
    signatures = [
        compute_wks(SpectralDecomposition(values, vectors), energies, sigma=width)
        for values, vectors in known.values
    ]
    mean = np.mean([each.mean(axis=0) for each in signatures], axis=0)
    deviation = np.sqrt(np.mean([np.square(each - mean).mean(axis=0) for each in signatures], axis=0))
    scaled = [(each - mean) / deviation for each in signatures]
    rng = np.random.default_rng(seed)
    drawn = [each[rng.permutation(len(each))[:SAMPLE]] for each in scaled]
    before = time.process_time()
    gaussians = fit_gmm_codebook(np.concatenate(drawn), N_GAUSSIANS, seed=seed)
    start += time.process_time() - before
    codes = np.stack([fisher_vector(each, *gaussians) for each in scaled])
    seconds = (time.process_time() - start) / len(codes)
    return correlation_distance(codes, codes), seconds


def shared_energies(spectra: Sequence[Array]) -> tuple[Array, float]:
    """Return energies between the typical extremes of all shapes, and Aubry's width for them."""
    low = float(np.median([np.log(values[1]) for values in spectra]))
    high = float(np.median([np.log(values[-1]) for values in spectra]))
    width = 7 * (high - low) / N_ENERGIES
    return np.linspace(low + 2 * width, high - 2 * width, N_ENERGIES), width


def row(name: str, scored: Repeated, seconds: float) -> Row:
    """Return the scores of one system."""
    spread = {"FT sd of seeds": scored.deviation["FT"], "FT error of classes": scored.class_error}
    return {"system": name} | scored.mean | spread | {"s a shape": seconds}


def paired(difference: Array, labels: Array) -> Row:
    """Return the mean difference of first tiers of queries, and its standard error by resampling classes."""
    return {"difference": float(difference.mean()), "standard error": error_of_classes(difference, labels)}


if __name__ == "__main__":
    main()
