"""The pictures of the README are drawn by the package as it is."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
from matplotlib.image import imread

ROOT = Path(__file__).parents[1]


def test_pictures_of_the_readme_are_drawn(tmp_path):
    """A run on small shapes draws every picture that the README shows, and none is blank."""
    spec = importlib.util.spec_from_file_location("pictures", ROOT / "docs" / "pictures.py")
    pictures = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(pictures)
    pictures.main(tmp_path / "images", share=0.1)
    every = re.findall(r"\(docs/images/([\w-]+\.png)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    # that of the explorer is taken in a browser, by docs/screenshot.py
    shown = [name for name in every if name != "explorer.png"]
    assert 0 < len(shown) == len(every) - 1
    assert sorted(path.name for path in (tmp_path / "images").iterdir()) == sorted(shown)
    assert all(np.ptp(imread(tmp_path / "images" / name)) > 0.5 for name in shown)
