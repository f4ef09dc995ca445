"""Which encoding of SPEM maps retrieves best, and does the choice hold: ``python benchmarks/codes_study.py``.

Every setting codes the same nodes of the same shapes, drawn once. Vocabularies are learnt on articulated
creatures, which are in no collection, and beside that on the shapes that are searched; means are over seeds
of k-means. Differences to the default are paired by query, and their errors are those of another draw of
classes. Then one half of the classes chooses among the settings and the other reports: see `_class_halves`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from os import cpu_count
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from _class_halves import Array, choices, error_of_classes, first_tier
from _encoders import (
    Encoder,
    count_codes,
    covariance_codes,
    fisher_codes,
    gaussian_ranks,
    several_vocabularies,
    soft_codes,
    vlad_codes,
    whitened_codes,
)
from _table import Benchmark, Row, data_root
from spem.codes.features import sweep_bands
from spem.codes.joining import join_codes
from spem.codes.settings import Settings
from spem.codes.sources import read_shapes
from spem.codes.surface_features import surface_features
from spem.embedding.maps import compute_maps
from spem.errors import SpemError
from spem.fields.hyperfield import Hyperfield
from spem.fields.rho import DEFAULT_RANGE, sample_rho
from spem.paper.data import Data
from spem.paper.scoring import compute_all
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import evaluate
from spem.shapes.creatures import creature, creature_kinds
from spem.shapes.shape import Shape

SEEDS, OWN_SEEDS, NODES, CREATURES_EACH, MOST_MAPS = 3, 2, 3000, 8, 16
QUICK_CLASSES, QUICK_EACH = 4, 4
DEFAULT, KEPT, JOINED = "default", "4 levels", "4 levels + surface"
COLLECTIONS = {"shrec11": 3, "tari1000": 2, "kimia216": 2}
# Views of the shapes: least and largest ρ in units of the default bounds, scheme, whether centred.
SWEEPS: dict[str, tuple[float, float, Any, bool]] = {
    "default": (1, 1, "linear", False),
    "ρ half": (0.5, 0.5, "linear", False),
    "ρ × 0.7": (0.7, 0.7, "linear", False),
    "ρ × 1.4": (1.4, 1.4, "linear", False),
    "ρ double": (2, 2, "linear", False),
    "ρ wider": (0.5, 2, "linear", False),
    "ρ squared": (1, 1, "squared", False),
    "ρ log": (1, 1, "log", False),
    "centred": (1, 1, "linear", True),
}
# What is tried on silhouettes too, where it must not hurt.
ELSEWHERE = (
    "default",
    "6 maps",
    "12 maps",
    "128 centres",
    "first moments alone",
    "scaling whiten",
    "ρ log",
    "default + ρ half",
    "Fisher vector of 32",
    "soft assignment of width 1.0",
    "2 levels",
    "3 levels",
    "4 levels",
    "6 levels",
    "4 levels of 32 centres",
)
Views = dict[str, Array]


@dataclass(frozen=True)
class Setting:
    """One way to make codes.

    Parameters
    ----------
    encoder
        From node features of one view to codes.
    views
        Views whose codes are joined with equal weights.
    n_maps
        Number of maps taken of a view; all of them of the surface.
    """

    encoder: Encoder = vlad_codes
    views: tuple[str, ...] = ("default",)
    n_maps: int = 8

    def codes(self, training: Sequence[Views], shapes: Sequence[Views], seed: int) -> Array:
        """Return the joined codes."""
        return join_codes([self._codes(view, training, shapes, seed) for view in self.views])

    def _codes(self, view: str, training: Sequence[Views], shapes: Sequence[Views], seed: int) -> Array:
        """Return the codes of one view."""
        if view == "surface":
            return vlad_codes([v[view] for v in training], [v[view] for v in shapes], seed)
        known, wanted = ([each[view][:, : self.n_maps] for each in views] for views in (training, shapes))
        return self.encoder(known, wanted, seed)


def settings_to_try(ndim: int) -> dict[str, Setting]:
    """Return the settings by name: all of maps and surface for solids, some of them for silhouettes."""
    tried = settings_of_maps()
    if ndim != 3:
        return {name: tried[name] for name in ELSEWHERE}
    return tried | {
        "surface alone": Setting(views=("surface",)),
        "default + surface": Setting(views=("default", "surface")),
        JOINED: Setting(partial(vlad_codes, levels=4), views=("default", "surface")),
    }


def settings_of_maps() -> dict[str, Setting]:
    """Return the settings of SPEM maps alone."""
    tried = {DEFAULT: Setting()}
    tried |= {f"{n} maps": Setting(n_maps=n) for n in (6, 10, 12, 16)}
    tried |= {f"{k} centres": Setting(partial(vlad_codes, n_centers=k)) for k in (16, 32, 128, 256)}
    tried |= {f"power {p}": Setting(partial(vlad_codes, power=p)) for p in (0.25, 0.7, 1.0)}
    tried |= {"first moments alone": Setting(partial(vlad_codes, moments=1))}
    tried |= {
        f"scaling {s}": Setting(partial(vlad_codes, scaling=s)) for s in ("none", "deviation", "whiten")
    }
    tried |= {view: Setting(views=(view,)) for view in SWEEPS if view != "default"}
    for extra in (("ρ half",), ("ρ double",), ("ρ half", "ρ double")):
        tried[" + ".join(("default", *extra))] = Setting(views=("default", *extra))
    tried |= {"linear + log": Setting(views=("default", "ρ log"))}
    tried |= {f"Fisher vector of {k}": Setting(partial(fisher_codes, count=k)) for k in (16, 32, 64)}
    tried |= {f"soft assignment of width {w}": Setting(partial(soft_codes, width=w)) for w in (0.25, 1.0)}
    tried |= {f"covariances of {k} centres": Setting(partial(covariance_codes, count=k)) for k in (16, 32)}
    tried |= {
        "counts of 256 words": Setting(count_codes),
        "normal scores of features": Setting(gaussian_ranks),
        "3 vocabularies": Setting(several_vocabularies),
    }
    tried |= {
        f"codes whitened with shrinkage {s}": Setting(partial(whitened_codes, shrinkage=s)) for s in (0.1, 10)
    }
    tried |= {f"{n} levels": Setting(partial(vlad_codes, levels=n)) for n in (2, 3, 4, 6)}
    tried["4 levels of 32 centres"] = Setting(partial(vlad_codes, levels=4, n_centers=32))
    return tried


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("codes_study", str(__doc__).splitlines()[0], argv)
    root = data_root()
    outside: dict[int, list[Views]] = {}
    for name, ndim in COLLECTIONS.items():
        if root is None or not (root / name / "labels.csv").is_file():
            benchmark.skip(f"{name}: no labels.csv under SPEM_DATA")
            continue
        items, labels = chosen_items(root, name, ndim, quick=benchmark.quick)
        if ndim not in outside:
            outside[ndim] = views_of(creatures(ndim, 1 if benchmark.quick else CREATURES_EACH))
        study(benchmark, name, views_of(items), np.array(labels), outside[ndim], settings_to_try(ndim))
    benchmark.write()


def study(
    benchmark: Benchmark,
    name: str,
    shapes: Sequence[Views],
    labels: Array,
    outside: Sequence[Views],
    tried: dict[str, Setting],
) -> None:
    """Score every setting on a collection, then choose on halves of its classes."""
    seeds, own_seeds = (1, 1) if benchmark.quick else (SEEDS, OWN_SEEDS if "surface" in shapes[0] else 0)
    rows: list[Row] = []
    kept: dict[str, list[Array]] = {}
    base = np.zeros(len(labels))
    for what, setting in tried.items():
        kept[what] = matrices(setting, outside, shapes, seeds)
        tiers = first_tier(kept[what], labels)
        base = base if rows else tiers
        own = first_tier(matrices(setting, shapes, shapes, own_seeds), labels) if own_seeds else None
        means = [evaluate(matrix, labels.tolist()) for matrix in kept[what]]
        rows.append(
            {
                "codes": what,
                "FT": tiers.mean(),
                "to default": (tiers - base).mean(),
                "error": error_of_classes(tiers - base, labels),
                "bull's eye": float(np.mean([scores.bulls_eye for scores in means])),
                "FT, own words": "" if own is None else own.mean(),
            }
        )
        print(f"{name}, {what}: FT {tiers.mean():.2f}", flush=True)
    benchmark.table(f"{name}: {len(labels)} shapes, {len(np.unique(labels))} classes", rows)
    benchmark.fact(f"error of the default's FT by classes, {name}", error_of_classes(base, labels))
    single = {what: found for what, found in kept.items() if "surface" not in what}
    report(benchmark, name, "maps alone", single, labels)
    if len(single) < len(kept):
        report(benchmark, name, "maps and surface", kept, labels)


def report(benchmark: Benchmark, name: str, what: str, kept: dict[str, list[Array]], labels: Array) -> None:
    """Choose on one half of the classes and report on the other."""
    found = choices(kept, labels, DEFAULT, 1 if benchmark.quick else 10)
    mean = {
        key: float(np.mean([getattr(c, key) for c in found])) for key in ("chosen", "reported", "default")
    }
    gains = np.array([choice.reported - choice.default for choice in found])
    row: Row = {
        "FT, half that chose": mean["chosen"],
        "FT, other half": mean["reported"],
        "default there": mean["default"],
        "gain": gains.mean(),
        "halves that gain": f"{(gains > 0).sum()} of {gains.size}",
    }
    picked = Counter(choice.setting for choice in found).most_common(3)
    row["chosen"] = "; ".join(f"{setting} ({count})" for setting, count in picked)
    benchmark.table(f"{name}, chosen on one half of the classes among {len(kept)}: {what}", [row])
    if name == "shrec11" and not benchmark.quick:
        gap = mean["chosen"] - mean["reported"]
        benchmark.target(f"FT of the half that chose over the other, {what}", gap, 0.5)


def matrices(setting: Setting, training: Sequence[Views], shapes: Sequence[Views], seeds: int) -> list[Array]:
    """Return the distances of one setting, one matrix a seed."""

    def one(seed: int) -> Array:
        codes = setting.codes(training, shapes, seed)
        return correlation_distance(codes, codes).astype(np.float32)

    # Threads: the kernels of k-means and of the codes leave the interpreter's lock.
    threads = Parallel(n_jobs=min(cpu_count() or 1, seeds), prefer="threads")
    return list(threads(delayed(one)(seed) for seed in range(seeds)))


def chosen_items(root: Path, name: str, ndim: int, *, quick: bool) -> tuple[list[Path | Shape], list[str]]:
    """Return the shapes of a collection, a few of them for a quick run."""
    found = Data(root).collection(name, ndim=ndim, per_class=QUICK_EACH if quick else None)
    classes = sorted(set(found.labels))[: QUICK_CLASSES if quick else None]
    pairs = [pair for pair in zip(found.items, found.labels, strict=True) if pair[1] in classes]
    return [item for item, _ in pairs], [label for _, label in pairs]


def creatures(ndim: int, each: int) -> list[Path | Shape]:
    """Make the shapes that outside vocabularies are learnt on."""
    rng = np.random.default_rng(1)
    voxels = Settings().voxels
    return [
        creature(kind, ndim=ndim, voxels=voxels, rng=rng) for kind in creature_kinds() for _ in range(each)
    ]


def views_of(items: Sequence[Path | Shape]) -> list[Views]:
    """Compute all views of all shapes, on all cores."""
    return compute_all(partial(_views, items=tuple(items)), items)


def _views(index: int, items: Sequence[Path | Shape]) -> Views:
    """Compute the views of one shape at nodes drawn once."""
    ((_, shape),) = read_shapes(items[index], Settings())
    if isinstance(shape, SpemError):
        raise shape
    low, high = DEFAULT_RANGE
    field = sweep_bands(shape, Settings(rho_ranges=((0.5 * low, 2 * high),)))
    drawn = np.sort(np.random.default_rng(index).permutation(shape.n_nodes)[:NODES])
    views = {view: _maps(field, *sweep)[drawn] for view, sweep in SWEEPS.items()}
    if shape.ndim == 3:
        (views["surface"],) = surface_features(shape, Settings(features="surface-wks"))
    return views


def _maps(field: Hyperfield, low: float, high: float, scheme: Any, centred: bool) -> Array:
    """Compute the maps of one range of ρ."""
    size, (least, largest) = field.shape.size, DEFAULT_RANGE
    rho = sample_rho(size, low * least * size, high * largest * size, Settings().n_rho, scheme)
    maps = compute_maps(replace(field, rho=rho), MOST_MAPS, centred=centred).values
    return np.ascontiguousarray(maps, np.float32)


if __name__ == "__main__":
    main()
