"""Parts of silhouettes: limbs found, and Rand index under change: ``python benchmarks/parts_silhouettes.py``.

A limb, a finger or a leg, is told apart if most of it lies in a part that no other limb has; limbs are what
opening finds. Under the conditions of Fig. 14 the parts of the altered silhouette are held against those of
the whole one by the Rand index, on the nodes that both have; nothing is matched.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from sklearn.metrics import adjusted_rand_score, rand_score

import spem
from _table import Benchmark, Row, data_root, timed
from spem.decomposition.choice import error_curve
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.joint import joint_parts
from spem.fields.superposition.fields import SourceFields
from spem.paper.perturbations import Mask, conditions, limbs

Setting = tuple[str, int]
Scores = tuple[float, float, float]

N_PARTS, PATCHES, RADIUS = 8, 200, 20
LIMIT = 0.85
DIVIDE = {"region": region_parts, "boundary": boundary_parts}
SETTINGS: tuple[Setting, ...] = (("region", N_PARTS), ("boundary", N_PARTS), ("region", 12))
CLASSES = {"cats": 9, "hands": 11}
# A part is untouched if the altered silhouette has this share of its nodes.
UNTOUCHED = 0.95


def fields(shape: spem.Shape, patches: int = PATCHES, boundary: str = "surface") -> SourceFields:
    """Solve for patches of a silhouette, as many as its points allow."""
    points = spem.sources(shape, boundary=boundary)
    if points.n_sources > patches:
        points = spem.sources(shape, patches, boundary=boundary)
    return spem.source_fields(points)


def silhouettes(benchmark: Benchmark) -> dict[str, list[spem.Shape]]:
    """Return shapes by set: made hands, and the cats and hands of tari1000."""
    count, radius = (1, 7) if benchmark.quick else (20, RADIUS)
    chance = [np.random.default_rng(i) for i in range(count)]
    made = [spem.creatures.creature("hand", voxels=12 * radius**2, rng=rng) for rng in chance]
    found = {"made hands": made}
    root = data_root()
    for name, number in CLASSES.items():
        files = [root / "tari1000" / f"obj{number}_{i}.png" for i in range(1, count + 1)] if root else []
        if files and all(file.is_file() for file in files):
            found[f"{name} of tari1000"] = [spem.read(file, inner_radius=radius) for file in files]
        else:
            benchmark.skip(f"{name}: tari1000 is absent")
    return found


def told_apart(shapes: list[spem.Shape]) -> Iterator[Row]:
    """Yield, for both settings, how many limbs have parts of their own."""
    every = [fields(shape) for shape in shapes]
    for over, divide in DIVIDE.items():
        count = apart = 0
        shares, seconds = [], []
        for shape, of_all in zip(shapes, every, strict=True):
            spent, parts = timed(lambda f=of_all, d=divide: d(f, N_PARTS))
            seconds.append(spent)
            held = [np.bincount(parts.node_labels[limb[shape.mask]] + 1) for limb in limbs(shape.mask)]
            main = [int(h.argmax()) for h in held]
            count += len(held)
            apart += sum(main.count(label) == 1 for label in main)
            shares += [h.max() / h.sum() for h in held]
        yield {
            "over": over,
            "shapes": len(shapes),
            "limbs": count,
            "told apart": apart,
            "share of limb in its part": float(np.mean(shares)),
            "seconds a shape": float(np.median(seconds)),
        }


def under_change(shapes: list[spem.Shape], settings: Sequence[Setting]) -> Iterator[Row]:
    """Yield the Rand indices under each condition, for each setting."""
    scores: dict[tuple[Setting, str], list[Scores]] = {}
    for i, shape in enumerate(shapes):
        mask = np.pad(shape.mask, int(2 * np.sqrt(shape.n_nodes / 10)))
        whole = labels(mask, settings)
        for name, altered in conditions(mask, np.random.default_rng(i)).items():
            for more in (0, 2) if name == "two protrusions" else (0,):
                found = labels(altered, [(over, k + more) for over, k in settings])
                condition = f"{name}, k + {more}" if more else name
                for over, k in settings:
                    score = compared(whole[over, k], found[over, k + more], mask & altered, k)
                    scores.setdefault(((over, k), condition), []).append(score)
    for setting in settings:
        of_all = [s for (which, name), s in scores.items() if which == setting and "k +" not in name]
        scores[setting, "all"] = [score for several in of_all for score in several]
    for (setting, condition), several in sorted(scores.items(), key=lambda item: settings.index(item[0][0])):
        rand, adjusted, untouched = np.transpose(several)
        yield {
            "over": setting[0],
            "k": setting[1],
            "condition": condition,
            "Rand, mean": float(rand.mean()),
            "worst": float(rand.min()),
            "adjusted": float(adjusted.mean()),
            "untouched parts": float(np.nanmean(untouched)),
        }


def divided_together(shapes: list[spem.Shape]) -> Iterator[Row]:
    """Yield the Rand index and the share of equal numbers where both silhouettes are divided at once."""
    scores: dict[str, list[tuple[float, float]]] = {}
    for i, shape in enumerate(shapes):
        mask = np.pad(shape.mask, int(2 * np.sqrt(shape.n_nodes / 10)))
        whole = fields(spem.Shape.from_mask(mask))
        for name, altered in conditions(mask, np.random.default_rng(i)).items():
            pair = joint_parts([whole, fields(spem.Shape.from_mask(altered))], N_PARTS).parts
            both = mask & altered
            a, b = (
                on_mask(of, parts.node_labels)[both] for of, parts in zip((mask, altered), pair, strict=True)
            )
            scores.setdefault(name, []).append((rand_score(a, b), float(np.mean(a == b))))
    scores["all"] = [score for several in scores.values() for score in several]
    for name, several in scores.items():
        rand, same = np.transpose(several)
        row: Row = {"condition": name, "Rand, mean": float(rand.mean()), "worst": float(rand.min())}
        yield row | {"same number": float(same.mean())}


def labels(mask: Mask, settings: Sequence[Setting]) -> dict[Setting, NDArray[np.int64]]:
    """Return the part of each pixel of a mask, -1 outside, in each setting."""
    solved, found = fields(spem.Shape.from_mask(mask)), {}
    for over, n_parts in settings:
        found[over, n_parts] = on_mask(mask, DIVIDE[over](solved, n_parts).node_labels)
    return found


def on_mask(mask: Mask, node_labels: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the part of each pixel of a mask, -1 outside."""
    grid = np.full(mask.shape, -1)
    grid[mask] = node_labels
    return grid


def compared(whole: NDArray[np.int64], altered: NDArray[np.int64], both: Mask, n_parts: int) -> Scores:
    """Return Rand index, adjusted Rand index, and the first of the parts that nothing was taken from."""
    a, b = whole[both], altered[both]
    before, after = (np.bincount(x[x >= 0], minlength=n_parts) for x in (whole.ravel(), a))
    untouched = np.isin(a, np.flatnonzero(after >= UNTOUCHED * before))
    third = rand_score(a[untouched], b[untouched]) if untouched.any() else np.nan
    return rand_score(a, b), adjusted_rand_score(a, b), third


def steadiness(shapes: list[spem.Shape]) -> Iterator[Row]:
    """Yield the Rand index against parts of the same shape made otherwise."""
    for over, divide in DIVIDE.items():
        found: dict[str, list[float]] = {}
        for shape in shapes:
            usual = fields(shape)
            first = divide(usual, N_PARTS).node_labels
            others = {
                "another seed": (shape, divide(usual, N_PARTS, rng=np.random.default_rng(1))),
                "voxel boundary": (shape, divide(fields(shape, boundary="voxel"), N_PARTS)),
                "all points": (shape, divide(fields(shape, shape.n_nodes), N_PARTS)),
                "half the patches": (shape, divide(fields(shape, PATCHES // 2), N_PARTS)),
            }
            for scale in (1.6, 0.75):
                coarse = spem.read(shape, spacing=scale * shape.spacing[0])
                others[f"spacing times {scale}"] = (coarse, divide(fields(coarse), N_PARTS))
            for name, (other, parts) in others.items():
                nearest = KDTree(other.points).query(shape.points)[1]
                found.setdefault(name, []).append(rand_score(first, parts.node_labels[nearest]))
        for name, values in found.items():
            mean, worst = float(np.mean(values)), float(np.min(values))
            yield {"over": over, "changed": name, "Rand, mean": mean, "worst": worst}


def suggestions(shapes: list[spem.Shape]) -> Row:
    """Return how often each number of parts is suggested."""
    suggested = [error_curve(fields(shape), 12).suggested for shape in shapes]
    return {f"k = {k}": suggested.count(k) for k in range(2, 13) if k in suggested}


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("parts_silhouettes", str(__doc__).splitlines()[0], argv)
    region_parts(fields(spem.synthetic.disk(6.0, 1.0), 20), 2)  # compiles
    for name, shapes in silhouettes(benchmark).items():
        rows = list(told_apart(shapes))
        benchmark.table(f"limbs of {name}", rows)
        for row in rows:
            share = row["told apart"] / max(row["limbs"], 1)
            benchmark.target(f"limbs told apart, {name}, {row['over']}", share, 0.95, at_least=True)
        few = shapes[:1] if benchmark.quick else shapes[:10]
        benchmark.table(f"the same {name} divided otherwise", list(steadiness(few)))
        benchmark.table(f"suggested numbers of parts of {name}", [suggestions(few)])
        if "hands" in name:
            rows = list(under_change(few, SETTINGS[:2] if benchmark.quick else SETTINGS))
            benchmark.table(f"Rand index of altered {name}", rows)
            for row in rows:
                if row["condition"] == "all":
                    what = f"Rand index, {name}, {row['over']}, k = {row['k']}"
                    benchmark.target(what, row["Rand, mean"], LIMIT, at_least=True)
            together = list(divided_together(few))
            benchmark.table(f"altered {name} divided together with the whole ones", together)
            what = f"Rand index, {name}, region, divided together"
            benchmark.target(what, together[-1]["Rand, mean"], LIMIT, at_least=True)
    benchmark.write()


if __name__ == "__main__":
    main()
