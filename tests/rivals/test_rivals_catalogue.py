"""The systems of Table 1: each is there, speaks the protocol, and says how it differs."""

from __future__ import annotations

import pickle

import pytest

from spem.errors import ParameterError
from spem.rivals import extra
from spem.rivals.catalogue import RIVALS, deviations, make_rival, missing


@pytest.mark.parametrize("name", RIVALS)
def test_each_system_speaks_the_protocol(name):
    """It has its name, describes and compares, can go to another process, and says what deviates."""
    rival = make_rival(name)
    assert rival.name == name
    assert callable(rival.describe)
    assert callable(rival.compare)
    assert pickle.loads(pickle.dumps(rival)) == rival  # noqa: S301 - our own object
    assert deviations(name)


def test_an_unknown_system_is_refused_with_those_that_are():
    """The message lists the names."""
    with pytest.raises(ParameterError, match="rival 'SURF' must be one of SD-GDM, iHKS"):
        make_rival("SURF")


def test_what_is_not_installed_is_named(monkeypatch):
    """Without the extra a system says what to install."""
    monkeypatch.setattr("spem.rivals.catalogue.has", lambda module: module not in ("cv2", "potpourri3d"))
    assert missing("SD-GDM") == f"needs potpourri3d; install {extra.EXTRA}"
    assert missing("MDS-CM-BOF") == f"needs opencv-python-headless; install {extra.EXTRA}"
    assert missing("Shape-DNA") == ""
