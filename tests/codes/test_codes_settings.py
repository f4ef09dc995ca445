"""Settings of a code."""

from __future__ import annotations

import json

import pytest

from spem.codes.settings import CODE_FORMAT, Settings
from spem.errors import ModelError, ParameterError


def test_settings_survive_json():
    """Settings written as JSON text and read again are equal."""
    settings = Settings(voxels=None, rho_ranges=((0.1, 0.2), (0.2, 0.4)), centred=True, power=0.75)
    assert Settings.from_json(json.loads(json.dumps(settings.to_json()))) == settings


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"voxels": 0}, "voxels=0 must be at least 1"),
        ({"n_maps": 0}, "n_maps=0"),
        ({"rho_ranges": ((0.3, 0.1),)}, "0 < low < high < inf"),
        ({"rho_ranges": ((0.3, float("inf")),)}, "0 < low < high < inf"),
        ({"rho_ranges": ()}, "empty"),
        ({"boundary": "face"}, "must be one of surface, voxel"),
        ({"scaling": True}, "must be one of standard, whiten, deviation, none"),
        ({"moments": 0}, "moments=0 must be 1 or 2"),
        ({"scheme": "cubic"}, "must be one of linear, squared, log"),
        ({"power": -0.1}, "must lie in"),
    ],
)
def test_settings_out_of_range_are_refused(bad, message):
    """Each setting is checked when it is made."""
    with pytest.raises(ParameterError, match=message):
        Settings(**bad)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"code_format": CODE_FORMAT + 1}, "a.model: codes of format .* upgrade spem"),
        ({"code_format": CODE_FORMAT - 1}, "make it again"),
        ({"code_format": "x"}, "make it again"),
        ({"colour": "blue"}, "differs in: colour"),
        ({"voxels": "many"}, "damaged"),
        ({"n_maps": -1}, "damaged .n_maps=-1"),
    ],
)
def test_settings_of_another_method_are_refused(change, message):
    """Settings that this version would not honour are not read."""
    with pytest.raises(ModelError, match=message):
        Settings.from_json(Settings().to_json() | change, "a.model")
