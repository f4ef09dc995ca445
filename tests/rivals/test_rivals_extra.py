"""Packages of the extra: imported when there, named with what installs them when not."""

import math

import pytest

from spem.errors import MissingExtraError
from spem.rivals.extra import has, require


def test_installed_module_is_returned():
    """A module that is installed is imported."""
    assert require("math", "math") is math


def test_missing_module_says_what_to_install():
    """A module that is not installed is named with the extra that has it."""
    assert not has("no_such_module")
    with pytest.raises(MissingExtraError, match=r"^needs nothing-such; install spem\[rivals\]$"):
        require("no_such_module", "nothing-such")


def test_missing_package_of_a_submodule_says_what_to_install():
    """A module of a package that is not installed is refused in the same way."""
    with pytest.raises(MissingExtraError, match="needs nothing-such; install"):
        require("no_such_package.module", "nothing-such")
