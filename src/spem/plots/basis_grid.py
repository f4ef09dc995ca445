"""The basis vectors of several shapes, one panel for each number, coloured by what sets the shapes apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from spem.errors import ParameterError
from spem.plots.figures import map_name
from spem.plots.style import FIELD_CMAP, MUTED, TEXT_SIZE, TITLE_SIZE, framed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure, SubFigure
    from numpy.typing import ArrayLike

    from spem.embedding.maps import Maps


def draw_bases(
    several: Sequence[Maps],
    shades: ArrayLike,
    figure: Figure | SubFigure,
    *,
    label: str,
    columns: int = 3,
    title: str = "",
) -> None:
    """Draw the basis vectors Φₙ over ρ of several shapes, as Figs. 9 and 10 have them.

    Parameters
    ----------
    several
        Maps of shapes, of the same ρ.
    shades
        ``(n_shapes,)`` the number that colours each shape: its scale, say.
    figure
        Empty figure, or part of one, with constrained layout.
    label
        What the numbers are.
    columns
        Panels in a row.
    title
        Words above all.

    Raises
    ------
    ParameterError
        If there is not one number for each of at least one shape.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> maps = SimpleNamespace(rho=np.array([1.0, 2.0]), basis=np.eye(2))
    >>> figure = new_figure(4, 3)
    >>> draw_bases([maps, maps], [1, 2], figure, label="scale")
    >>> [ax.get_title() for ax in figure.axes]
    ['Φ₁', 'Φ₂', '']
    """
    numbers = np.asarray(shades, np.float64)
    if not several or numbers.shape != (len(several),):
        msg = (
            f"bases: expected a number for each of at least one shape, got {numbers.shape} for {len(several)}"
        )
        raise ParameterError(msg)
    n_maps = min(maps.basis.shape[1] for maps in several)
    across = min(columns, n_maps)
    axes = figure.subplots(-(-n_maps // across), across, sharex=True, squeeze=False).ravel()
    scale = Normalize(float(numbers.min()), float(numbers.max()))
    colours = mpl.colormaps[FIELD_CMAP](scale(numbers))
    for n, ax in enumerate(axes[:n_maps]):
        ax.axhline(0, color=MUTED, linewidth=0.6)
        for maps, colour in zip(several, colours, strict=True):
            finite = np.isfinite(maps.rho)
            ax.plot(maps.rho[finite], maps.basis[finite, n], color=colour, linewidth=0.9)
        framed(ax, "ρ" if n >= n_maps - across else "", "")
        ax.set_title(map_name(n).replace("P", "Φ"), fontsize=TITLE_SIZE)
        ax.tick_params(labelsize=TEXT_SIZE - 1)
    for ax in axes[n_maps:]:
        ax.set_axis_off()
    bar = figure.colorbar(ScalarMappable(scale, FIELD_CMAP), ax=list(axes), aspect=30, pad=0.02)
    bar.set_label(label, fontsize=TEXT_SIZE)
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    bar.outline.set_visible(False)
    if title:
        figure.suptitle(title, fontsize=TITLE_SIZE)
