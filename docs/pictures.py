"""Draw the pictures of the README from synthetic shapes: python docs/pictures.py."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from PIL import Image

import spem
from spem.plots.figures import figure_fields, figure_maps
from spem.plots.parts import figure_parts
from spem.plots.profiles import draw_basis, draw_profiles
from spem.plots.sources import figure_source
from spem.plots.thumbnails import thumbnail
from spem.shapes.meshes import mesh_shape

FOLDER = Path(__file__).parent / "images"


def main(folder: Path = FOLDER, *, share: float = 1.0) -> None:
    """Draw every picture, of shapes with this share of their voxels."""
    folder.mkdir(exist_ok=True)

    def save(figure: Figure, name: str, *, palette: bool = True) -> None:
        FigureCanvasAgg(figure)
        target = BytesIO()
        figure.savefig(target, dpi=110)
        picture = Image.open(target).convert("RGB")
        # A palette makes the files a third as large; it has no place for a colour that few pixels have.
        written = picture.quantize(256, dither=Image.Dither.NONE) if palette else picture
        written.save(folder / name, optimize=True)

    flat = spem.creatures.creature("hand", voxels=int(9_000 * share), rng=np.random.default_rng(4))
    flat = replace(flat, spacing=(1.0, 1.0), origin=(0.0, 0.0))  # lengths in pixels, as of an image
    solid = spem.creatures.creature("dog", ndim=3, voxels=int(40_000 * share), rng=np.random.default_rng(2))
    field = spem.sweep(flat)
    rho = [4.0, 8.0, 16.0, 32.0]
    titles = [f"ρ = {r:g} pixels" for r in rho]
    save(figure_fields(flat, spem.field(flat, rho), titles, columns=4), "fields.png")
    save(figure_maps(spem.maps(field), columns=6), "maps.png")
    save(figure_maps(spem.maps(solid), columns=3), "maps-3d.png")

    profiles = Figure(figsize=(9, 3), layout="constrained")
    left, middle, right = profiles.subplots(1, 3)
    depth = np.argsort(field.at(0.12 * flat.size))
    nodes = depth[(np.array([0.0, 0.35, 0.6, 0.8, 0.95]) * (flat.n_nodes - 1)).astype(int)]
    draw_profiles(field, nodes, middle, shape_ax=left)
    draw_basis(spem.maps(field, n_maps=4), right)
    for axis in (middle, right):
        axis.set_xlabel("ρ, pixels")
    save(profiles, "profiles.png")
    save(answers(share), "answers.png")

    every = spem.sources(flat).position
    tip = spem.sources(flat, at=every[np.argmin(every[:, 0])])
    save(figure_source(spem.source_fields(tip), 0), "source.png", palette=False)
    divisions = [spem.parts(flat), spem.parts(flat, over="boundary")]
    save(figure_parts(divisions, ["of the region", "of the boundary"]), "parts.png")
    save(poses(share), "parts-3d.png")


def poses(share: float = 1.0) -> Figure:
    """Draw the parts that poses of one kind share, on their own meshes."""
    rngs = [np.random.default_rng(seed) for seed in (1, 2, 5)]
    meshes = [spem.creatures.creature_mesh("dog", rng, faces=8000) for rng in rngs]
    voxels = int(20_000 * share)
    shapes = [mesh_shape(*mesh, voxels=voxels, name=f"dog {i}") for i, mesh in enumerate(meshes, 1)]
    return figure_parts(spem.parts(shapes, 9), meshes=meshes)


def answers(share: float = 1.0) -> Figure:
    """Draw the first answers to a query of four kinds, among creatures of all kinds."""
    rng = np.random.default_rng(1)
    shapes, labels = zip(*spem.creatures.collection(n_per_class=6, rng=rng), strict=True)
    codes = spem.encode(list(shapes), voxels=int(15_000 * share))
    figure = Figure(figsize=(9, 5.4), layout="constrained")
    rows = figure.subplots(4, 6)
    for row, kind in zip(rows, ("human", "ant", "giraffe", "crab"), strict=True):
        query = labels.index(kind)
        for axis, answer in zip(row, spem.search(codes, shapes[query], k=6), strict=True):
            found = codes.names.index(answer.name)
            axis.imshow(imread(BytesIO(thumbnail(shapes[found], 160))))
            axis.set_title(
                "query" if found == query else f"{labels[found]}, {answer.distance:.2f}", fontsize=9
            )
            axis.axis("off")
    return figure


if __name__ == "__main__":
    main()
