"""``spem info``: what was read and what was repaired."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from spem.cli.options import (
    Components,
    ComponentsChoice,
    Dark,
    GridSpacing,
    InnerRadius,
    Json,
    Label,
    ShapeFile,
    SignedDistance,
    Spacing,
    Threshold,
    Voxels,
    read_shape,
)
from spem.cli.output import print_json

if TYPE_CHECKING:
    from spem.shapes.shape import Report, Shape


def info(
    shape: ShapeFile,
    voxels: Voxels = None,
    spacing: Spacing = None,
    inner_radius: InnerRadius = None,
    grid_spacing: GridSpacing = None,
    threshold: Threshold = None,
    dark: Dark = None,
    label: Label = None,
    signed_distance: SignedDistance = None,
    components: Components = ComponentsChoice.largest,
    json: Json = False,
) -> None:
    """Tell what is read from a file, and what is repaired.

    \b
    Examples:
      spem info hand.png
      spem info cat.off --voxels 100000
      spem info teeth.nii.gz --label 3 --json
    """  # noqa: D301
    found = read_shape(
        shape,
        voxels=voxels,
        spacing=spacing,
        inner_radius=inner_radius,
        grid_spacing=grid_spacing,
        threshold=threshold,
        dark=dark,
        label=label,
        signed_distance=signed_distance,
        components=components,
    )
    facts = describe(found)
    if json:
        print_json(facts)
        return
    width = max(map(len, facts))
    for key, value in facts.items():
        text = _text(value)
        if text:
            typer.echo(f"{key.replace('_', ' '):<{width}}  {text}")


def describe(shape: Shape) -> dict[str, Any]:
    """Return the facts about a shape by name.

    Parameters
    ----------
    shape
        Any shape.

    Examples
    --------
    >>> import spem
    >>> describe(spem.synthetic.interval(length=9.0, spacing=1.0))["dimensions"]
    1
    """
    from spem.fields.rho import sample_rho

    report = shape.report
    rho = sample_rho(shape.size, count=2)
    return {
        "name": shape.name,
        "source": report.source,
        "dimensions": shape.ndim,
        "voxels": shape.n_nodes,
        "grid": list(shape.mask.shape),
        "spacing": list(shape.spacing),
        "spacing_from": spacing_source(report),
        "origin": list(shape.origin),
        "volume": shape.volume,
        "size": shape.size,
        "default_rho": [float(rho[0]), float(rho[1])],
        "cut_edges": len(shape.cuts),
        "method": report.method,
        "watertight": report.watertight,
        "components": report.components,
        "volume_kept": report.volume_kept,
        "repairs": list(report.repairs),
        "surface": _surface(shape),
    }


def spacing_source(report: Report) -> str:
    """Say where the spacing of a shape comes from.

    Examples
    --------
    >>> from spem.shapes.shape import Report
    >>> spacing_source(Report("hand.png"))
    'none in the file, 1 taken'
    """
    if report.watertight is not None:
        return "the grid asked for"
    resampled = [phrase for phrase in report.repairs if phrase.startswith("resampled from")]
    told = [phrase for phrase in report.method.split("; ") if "spacing" in phrase]
    return (resampled + told + ["none in the file, 1 taken"])[0]


def _surface(shape: Shape) -> str | None:
    """Say what the surface of a solid is in codes; nothing of other shapes."""
    if shape.ndim != 3:
        return None
    from spem.shapes.boundary_surface import boundary_surface

    surface = boundary_surface(shape)
    done = [phrase for phrase in surface.repairs if phrase not in shape.report.repairs]
    size = f"{len(surface.vertices)} vertices, {len(surface.faces)} faces"
    return f"{'; '.join(done) or 'its mesh'}: {size}"


def _text(value: Any) -> str:
    """Write a fact for people; nothing where it is unknown."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        joint = "; " if value and isinstance(value[0], str) else " "
        return joint.join(_text(entry) for entry in value) or "none"
    return str(value)
