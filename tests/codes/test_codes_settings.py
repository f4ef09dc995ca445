"""Settings of a code."""

from __future__ import annotations

import json

import numpy as np
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
        ({"voxels": 0}, "voxels=0 must be a whole number of at least 1"),
        ({"voxels": 2.5}, "voxels=2.5 must be a whole number"),
        ({"voxels": True}, "voxels=True must be a whole number"),
        ({"n_centers": 3.5}, "n_centers=3.5 must be a whole number"),
        ({"n_rho": None}, "n_rho=None must be a whole number"),
        ({"seed": -1}, "seed=-1 must be a whole number from 0 to 4294967295"),
        ({"seed": "x"}, "seed='x' must be a whole number"),
        ({"threshold": float("nan")}, "threshold=nan must be a finite number"),
        ({"threshold": "low"}, "threshold='low' must be a finite number"),
        ({"power": float("nan")}, "power=nan must be a finite number"),
        ({"power": "high"}, "power='high' must be a finite number"),
        ({"dark": "no"}, "dark='no' must be True or False"),
        ({"centred": 1}, "centred=1 must be True or False"),
        ({"n_rho": 4}, "n_maps=8 must be at most n_rho=4"),
        ({"rho_ranges": (1, 2)}, r"rho_ranges=\(1, 2\) must be pairs"),
        ({"rho_ranges": ((1,),)}, "must be pairs"),
        ({"rho_ranges": None}, "must be pairs"),
        ({"n_maps": 0}, "n_maps=0"),
        ({"rho_ranges": ((0.3, 0.1),)}, "0 < low < high < inf"),
        ({"rho_ranges": ((0.3, float("inf")),)}, "0 < low < high < inf"),
        ({"rho_ranges": ()}, "empty"),
        ({"boundary": "face"}, "must be one of surface, voxel"),
        ({"scaling": True}, "must be one of standard, whiten, deviation, none"),
        ({"moments": 0}, "moments=0 must be a whole number from 1 to 2"),
        ({"scheme": "cubic"}, "must be one of linear, squared, log"),
        ({"power": -0.1}, "must lie in"),
        ({"features": "sihks"}, "features='sihks' must be auto, or one or more of spem, hks, si-hks, wks, "),
        ({"features": "auto+spem"}, "features='auto.spem' must be auto, or one or more of"),
        ({"features": "spem+spem"}, "features='spem.spem' must be auto, or one or more of"),
        ({"features": ""}, "features='' must be auto, or"),
        ({"features": None}, "features=None must be auto, or"),
        ({"n_pairs": 0}, "n_pairs=0 must be a whole number of at least 1"),
        (
            {"features": "spem", "n_pairs": 50},
            "n_pairs: a setting of features 'hks' or 'si-hks' or 'wks' .*, not of 'spem'; leave it",
        ),
        ({"features": "wks", "n_rho": 32}, "n_rho: a setting of features 'spem', not of 'wks'; leave it out"),
        ({"features": "hks", "rho_ranges": ((0.1, 0.2),)}, "rho_ranges: a setting of features 'spem'"),
        ({"features": "hks", "centred": True}, "centred: a setting of features 'spem'"),
        ({"code_format": 9}, "code_format=9: this spem makes format"),
    ],
)
def test_settings_out_of_range_are_refused(bad, message):
    """Each setting is checked when it is made."""
    with pytest.raises(ParameterError, match=message):
        Settings(**bad)


def test_numbers_of_numpy_are_settings():
    """Numbers of NumPy are taken, and kept as plain ones that JSON can write."""
    made = Settings(voxels=np.int64(900), power=np.float32(0.5), dark=np.bool_(True), seed=np.uint8(3))
    assert Settings.from_json(json.loads(json.dumps(made.to_json()))) == made == Settings.of(made.to_json())


def test_option_that_is_no_setting_is_named():
    """Of several options only the unknown one is blamed."""
    with pytest.raises(ParameterError, match=r"^nope: no setting of a code; expected any of voxels, .*seed$"):
        Settings.of({"voxels": 900, "nope": 1})


def test_settings_of_a_signature():
    """More values than ρ are fine, all of one band; the settings of the paper have no other kind."""
    made = Settings(features="wks", n_maps=80, n_pairs=200)
    two = Settings(features="spem", rho_ranges=((0.1, 0.2), (0.2, 0.4)))
    assert (made.n_bands, two.n_bands) == (1, 2)
    assert Settings.from_json(made.to_json()) == made
    with pytest.raises(ParameterError, match=r"features='wks': the settings of 5.5 are of SPEM maps"):
        Settings.paper(features="wks")


def test_parts_of_joined_features():
    """Each has its kind's defaults but what was given, and the settings of other kinds as they come."""
    joined = Settings(features="spem+surface", n_centers=32, n_pairs=50, n_rho=20)
    spem, surface = joined.parts(3)
    assert (spem.features, spem.n_centers, spem.n_maps, spem.n_rho, spem.n_pairs) == ("spem", 32, 8, 20, 100)
    assert (surface.features, surface.n_centers, surface.n_pairs, surface.n_rho) == (
        "surface-wks",
        32,
        50,
        64,
    )
    assert joined.resolved(3) == Settings(features="spem+surface-wks", n_centers=32, n_pairs=50, n_rho=20)
    assert Settings().resolved(4) == Settings(features="spem")
    assert (spem.levels, Settings(features="spem").levels, Settings(levels=3).parts(3)[0].levels) == (1, 4, 3)
    with pytest.raises(
        ParameterError, match=r"'surface' are of 2-D or 3-D shapes, not of 4-D ones; take .*'spem'"
    ):
        joined.parts(4)


@pytest.mark.parametrize(("features", "ndim"), [("auto", 2), ("surface", 2), ("surface", 3)])
def test_settings_of_kinds_that_a_shape_does_not_get_are_refused(features, ndim):
    """A setting of maps says nothing of contours and surfaces, once it is known that these are meant."""
    made = Settings(features=features, rho_ranges=((0.1, 0.2),))
    for resolve in (made.parts, made.resolved):
        with pytest.raises(ParameterError, match="rho_ranges: a setting of features 'spem', not of"):
            resolve(ndim)


def test_settings_of_files_from_before_a_setting_stand_at_its_default():
    """Files that know nothing of kinds hold SPEM maps; one that lacks an older setting is refused."""
    values = Settings(features="spem", n_maps=4).to_json()
    for name in ("features", "n_pairs"):
        del values[name]
    assert Settings.from_json(values) == Settings(features="spem", n_maps=4)
    del values["n_maps"]
    with pytest.raises(ModelError, match="differs in: n_maps; make it again"):
        Settings.from_json(values)


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
