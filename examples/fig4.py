"""
Figure 4: superposition in one dimension
========================================

The equation is linear. On an interval the boundary is two points, and the field of both, v = 1 at either
end, is the sum of two fields that have 1 at one end and 0 at the other (2.2, 2.3). Rows differ in ρ: the
shorter it is, the less an end sees of the other.
"""

import numpy as np

import spem
from spem.paper.data import Data
from spem.paper.findings import Finding, Picture, judged
from spem.paper.present import present
from spem.plots.sources import figure_superposition

LENGTH, SPACING = 40.0, 0.1
RHO = (2.0, 8.0, 30.0)
ROUNDING = 1e-12


def make(data: Data) -> Finding:
    """Solve for both ends apart and together, and compare with the closed form."""
    spacing = 10 * SPACING if data.quick else SPACING
    line = spem.synthetic.interval(LENGTH, spacing)
    sources = spem.sources(line)
    slices = [spem.source_fields(sources, rho) for rho in RHO]
    whole = spem.field(line, RHO, solver=spem.Direct())
    middle = line.points[:, 0] - sources.position.mean()
    exact = np.stack([np.cosh(middle / rho) / np.cosh(LENGTH / 2 / rho) for rho in RHO], axis=1)
    sums = np.stack([fields.values.sum(axis=0) for fields in slices], axis=1)
    error = np.abs(sums - whole).max(axis=0)
    against_exact = np.abs(sums - exact).max(axis=0)
    claim = judged(
        "The solution for the sum of two boundary conditions is the sum of their solutions, for each ρ "
        "(2.3).",
        "superpositions of the pair of solutions on the respective row",
        f"the sums differ from the field of both ends by at most {error.max():.0e}, and from "
        f"cosh(x/ρ)/cosh(L/2ρ) by {against_exact.max():.0e}",
        bool(error.max() < ROUNDING),
        note="Solving for both at once and apart differs by more than rounding.",
    )
    return Finding(
        f"An interval of length {LENGTH:g}, spacing {spacing:g}.",
        (claim,),
        (Picture("superposition", figure_superposition(slices), "Each end alone, and both, for three ρ."),),
        numbers={"rho": RHO, "sum_minus_whole": error, "sum_minus_exact": against_exact},
    )


if __name__ == "__main__":
    finding = present(make)
