"""Whatever reads fields says what it expects when it is given something else."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.measurements import centred_logs, measurements
from spem.errors import ParameterError

READERS = {
    "region_parts": lambda given: region_parts(given, 2),
    "boundary_parts": lambda given: boundary_parts(given, 2),
    "joint_parts": lambda given: spem.joint_parts([given], 2),
    "centred_logs": centred_logs,
    "measurements": measurements,
    "error_curve": lambda given: spem.error_curve(given, 2),
    "node_correlation": lambda given: spem.node_correlation(given, 0),
    "source_correlation": lambda given: spem.source_correlation(given, 0),
    "source_node_correlation": lambda given: spem.source_node_correlation(given, 0),
    "cluster_interactions": lambda given: spem.cluster_interactions(given, 2),
    "source_gradient": lambda given: spem.source_gradient(given, 0),
    "source_streamlines": lambda given: spem.source_streamlines(given, 0, [0]),
}


@pytest.mark.parametrize("reader", READERS)
def test_sources_in_place_of_their_fields_are_refused(reader):
    """One line says what was expected, what came, and how to make it."""
    sources = spem.sources(spem.Shape.from_mask(np.ones((3, 4))))
    with pytest.raises(ParameterError, match="expected SourceFields, got Sources; solve for them first"):
        READERS[reader](sources)


def test_fields_of_one_shape_are_no_list():
    """A joint fit takes the fields of all shapes."""
    fields = spem.source_fields(spem.sources(spem.Shape.from_mask(np.ones((3, 4)))))
    with pytest.raises(ParameterError, match="expected Sequence, got SourceFields; give the fields of all"):
        spem.joint_parts(fields, 2)
