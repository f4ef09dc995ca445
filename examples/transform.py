"""
The walk that is told where to end: Doob's h-transform
======================================================

Of all walkers that are killed on their way at the rate 1/ρ², look only at those that arrive. They walk as if
nobody were ever killed, on the same grid, with other conductances: c̃_xy = h(x) h(y) c_xy with h = v, the
field itself (3.3). That is Doob's transform. It works for the field of a single boundary point too: then
every walker comes to that point.

The transformed walker drifts: on average it moves along ∇ log h. A small ρ makes the drift strong, since
those who dawdle do not live to arrive. ρ = ∞ leaves a plain walk without any drift.
"""

import numpy as np

import spem
from spem.fields.walks.lifetimes import expected_time
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.limbs import fingers
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.paper.transform import figure_bias, figure_paths, measure_transform, sampled_times

# In units of the inner radius.
RHO = 0.3


def make(data: Data) -> Finding:
    """Check the transform as matrices, its drift and its bias; draw walks with and without it."""
    rng, radius = np.random.default_rng(5), 10.0 if data.quick else 20.0
    found = chosen(data, "hand", inner_radius=radius)
    hand, rho = found.shapes[0], RHO * radius
    sources = spem.sources(hand, 60)
    tip, _ = sources.nearest(hand.points[fingers(hand).tip(0)])
    walk = spem.killed_walk(sources.system, rho)
    arriving = spem.arriving_walk(walk)
    to_tip = spem.source_walk(spem.source_fields(sources.select(tip), rho), 0)
    measured = measure_transform(walk, to_tip)
    scales = radius * np.geomspace(0.05, 3.2, 5 if data.quick else 13)
    walks = [spem.arriving_walk(spem.killed_walk(walk.system, scale)) for scale in scales]
    times = np.array([expected_time(w) for w in walks])
    start = int(np.argmin(arriving.log_h))
    counted = sampled_times(walks, start, 60 if data.quick else 400, rng)
    free = spem.killed_walk(walk.system, np.inf)
    drawn = {
        "free, ρ = ∞": free,
        f"those that arrive, ρ = {rho:g}": arriving,
        f"those that come to a tip, ρ = {rho:g}": to_tip,
    }
    pictures = (
        Picture(
            "walks",
            figure_paths(drawn, start, rng),
            "Walks from the middle of the palm: free ones; those of a small ρ that arrive; those that arrive "
            "at the tip of the little finger.",
        ),
        Picture(
            "bias",
            figure_bias(arriving, start, scales, times[:, start], counted),
            "Left: the drift ∇ log v, as long as its arrow. Right: mean time to arrive from the black dot, "
            "solved for and of walks, with 99 % intervals.",
        ),
    )
    falls = float((np.diff(times, axis=0) > 0).mean())
    numbers = measured | {"rho": scales, "time": times[:, start], "counted": counted, "falls": falls}
    return Finding(found.source, claims(measured, falls, times[:, start]), pictures, numbers)


def claims(measured: dict[str, float], falls: float, times: np.ndarray) -> tuple[Claim, ...]:
    """Judge (3.3) and what is said about the bias."""
    kept = max(measured["killed, h = v"], measured["killed, h of a source"])
    lost = min(measured["killed, h = 1"], measured["killed, h = sqrt v"])
    return (
        judged(
            "1/h ∘ (Δ − 1/ρ²) ∘ h is the Laplacian of another measure, h²dμ (3.3).",
            "equal",
            f"as matrices, with h = v, equal but for {measured['identity']:.0e}",
            measured["identity"] < 1e-12,
            note="The difference is more than rounding.",
        ),
        judged(
            "The conductances h(x) h(y) c_xy induce the new transition probabilities (3.1).",
            "c̃_xy = h(x) h(y) c_xy",
            f"with h = v or the field of a source nobody is killed (at most {kept:.0e} a step), with "
            f"h = 1 or √v up to {lost:.2f}: it takes a solution of the screened equation",
            kept < 1e-10 < lost,
            note="The chances of a step do not add up to 1.",
        ),
        judged(
            "The conditioned walk behaves like the unconditioned one, biased by a drift (3.1).",
            "isotropic drift h",
            f"its mean velocity is 2 ∇ log h, to {measured['drift']:.0e}; it has a direction, and what is "
            f"isotropic is the diffusion, to {100 * (measured['spread'] - 1):.0f} % on this grid",
            measured["drift"] < 1e-10,
            note="The velocity is another.",
        ),
        judged(
            "Another ρ is another bias: walks arrive the sooner the smaller ρ is (3.1).",
            "different drift amounts",
            f"the mean time falls with ρ at {100 * falls:.1f} % of the nodes, from {times[-1]:.3g} to "
            f"{times[0]:.3g} pixels² in the middle",
            falls == 1.0,
            note="At some node it does not.",
        ),
        judged(
            "Zero drift is the unconditioned walk, without any screening (3.1).",
            "zero",
            f"for ρ = ∞ the drift is {measured['drift, rho inf']:.0e} per voxel",
            measured["drift, rho inf"] < 1e-10,
            note="The field of ρ = ∞ is not 1.",
        ),
    )


if __name__ == "__main__":
    finding = present(make)
