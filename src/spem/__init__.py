"""Screened Poisson hyperfields: shapes in; fields, SPEM maps, codes and ranked answers out."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spem.api.fields import field, maps, sweep, sweep_many
    from spem.api.parts import parts, source_fields, sources
    from spem.codes.codes import Codes, Failure
    from spem.codes.joining import fusion_weights, join_codes
    from spem.codes.model import Model
    from spem.codes.moments import NodalMoments, hu_moments
    from spem.codes.settings import Settings
    from spem.codes.vlad import VLAD
    from spem.codes.vocabulary import Vocabulary
    from spem.collections import classify, encode, evaluate, search
    from spem.decomposition.choice import ErrorCurve, error_curve
    from spem.decomposition.clusters import Clusters, cluster_interactions
    from spem.decomposition.interactions import node_correlation, source_correlation, source_node_correlation
    from spem.decomposition.joint import joint_parts
    from spem.decomposition.matched import MatchedParts
    from spem.decomposition.matching import match_parts
    from spem.decomposition.parts import Parts
    from spem.decomposition.sparse_coding import NonnegativeSparseCoding
    from spem.decomposition.transfer import vertex_labels
    from spem.embedding.boundary_contexts import boundary_contexts
    from spem.embedding.boundary_response import BoundaryResponse, boundary_response
    from spem.embedding.correspondence import correspond, match_nodes, surroundings
    from spem.embedding.heat import diffusion_distance, heat_kernel
    from spem.embedding.maps import Maps
    from spem.embedding.nodal import nodal_clusters, nodal_domains, nodal_thresholds
    from spem.embedding.shape_context import inner_distance_shape_context, shape_context
    from spem.embedding.signatures import (
        heat_kernel_signature,
        scale_invariant_signature,
        shared_times,
        shared_values,
        wave_kernel_signature,
    )
    from spem.errors import (
        ClusterError,
        ConvergenceError,
        LabelError,
        ModelError,
        ParameterError,
        QueueFullError,
        ReadError,
        SandboxError,
        ShapeError,
        SizeError,
        SpemError,
    )
    from spem.fields.boundary.sources import Sources
    from spem.fields.boundary_distance import distance_to_boundary, screened_distance
    from spem.fields.geodesics import inner_distances, source_distances
    from spem.fields.gradients import source_gradient
    from spem.fields.hyperfield import Hyperfield
    from spem.fields.isocontours import iso_contours, iso_surfaces
    from spem.fields.level_curves import level_curvature, turning_angles
    from spem.fields.solvers.cg import ConjugateGradient
    from spem.fields.solvers.cuda.device import Cuda
    from spem.fields.solvers.direct import Direct
    from spem.fields.solvers.explicit import ExplicitIteration
    from spem.fields.solvers.gradients import MultigridGradients
    from spem.fields.solvers.lanczos import BlockLanczos
    from spem.fields.solvers.protocol import Solution
    from spem.fields.solvers.sweep import Sweep
    from spem.fields.spectrum import Spectrum, solve_spectrum
    from spem.fields.streamlines import Streamlines, source_streamlines
    from spem.fields.superposition.fields import SourceFields
    from spem.fields.superposition.hyperfield import SourceHyperfield
    from spem.fields.surface_spectrum import SurfaceSpectrum, solve_surface_spectrum
    from spem.fields.walks.conditioned import arriving_walk, source_walk, transform_walk
    from spem.fields.walks.estimate import estimate_field
    from spem.fields.walks.intervals import Estimate
    from spem.fields.walks.killed import Walk, killed_walk
    from spem.fields.walks.paths import sample_paths
    from spem.fields.walks.transient import Transient, solve_transient
    from spem.index.adding import Added
    from spem.index.answers import Answers
    from spem.index.index import Index
    from spem.retrieval.classification import Classification, linear_svm
    from spem.retrieval.diffusion import rerank
    from spem.retrieval.distances import correlation_distance, fuse
    from spem.retrieval.evaluation import PrecisionRecall, Scores, bulls_eye, precision_recall
    from spem.retrieval.ranking import Answer
    from spem.retrieval.sizes import of_one_size, size_distance
    from spem.shapes import creatures, synthetic
    from spem.shapes.boundary_surface import boundary_surface
    from spem.shapes.landmarks import CreaturePoses, creature_poses
    from spem.shapes.levels import signed_distance_shape
    from spem.shapes.read import read, read_all
    from spem.shapes.shape import Cuts, Report, Shape

__version__ = "0.1.0"

__all__ = [  # noqa: RUF022 - capitals first, as Python sorts, in all three lists
    "Added",
    "Answer",
    "Answers",
    "BlockLanczos",
    "BoundaryResponse",
    "Classification",
    "ClusterError",
    "Clusters",
    "Codes",
    "ConjugateGradient",
    "ConvergenceError",
    "CreaturePoses",
    "Cuda",
    "Cuts",
    "Direct",
    "ErrorCurve",
    "Estimate",
    "ExplicitIteration",
    "Failure",
    "Hyperfield",
    "Index",
    "LabelError",
    "Maps",
    "MatchedParts",
    "Model",
    "ModelError",
    "MultigridGradients",
    "NodalMoments",
    "NonnegativeSparseCoding",
    "ParameterError",
    "Parts",
    "PrecisionRecall",
    "QueueFullError",
    "ReadError",
    "Report",
    "SandboxError",
    "Scores",
    "Settings",
    "Shape",
    "ShapeError",
    "SizeError",
    "Solution",
    "SourceFields",
    "SourceHyperfield",
    "Sources",
    "Spectrum",
    "SpemError",
    "Streamlines",
    "SurfaceSpectrum",
    "Sweep",
    "Transient",
    "VLAD",
    "Vocabulary",
    "Walk",
    "arriving_walk",
    "boundary_contexts",
    "boundary_response",
    "boundary_surface",
    "bulls_eye",
    "classify",
    "cluster_interactions",
    "correlation_distance",
    "correspond",
    "creature_poses",
    "creatures",
    "diffusion_distance",
    "distance_to_boundary",
    "encode",
    "error_curve",
    "estimate_field",
    "evaluate",
    "field",
    "fuse",
    "fusion_weights",
    "heat_kernel",
    "heat_kernel_signature",
    "hu_moments",
    "inner_distance_shape_context",
    "inner_distances",
    "iso_contours",
    "iso_surfaces",
    "join_codes",
    "joint_parts",
    "killed_walk",
    "level_curvature",
    "linear_svm",
    "maps",
    "match_nodes",
    "match_parts",
    "nodal_clusters",
    "nodal_domains",
    "nodal_thresholds",
    "node_correlation",
    "of_one_size",
    "parts",
    "precision_recall",
    "read",
    "read_all",
    "rerank",
    "sample_paths",
    "scale_invariant_signature",
    "screened_distance",
    "search",
    "shape_context",
    "shared_times",
    "shared_values",
    "signed_distance_shape",
    "size_distance",
    "solve_spectrum",
    "solve_surface_spectrum",
    "solve_transient",
    "source_correlation",
    "source_distances",
    "source_fields",
    "source_gradient",
    "source_node_correlation",
    "source_streamlines",
    "source_walk",
    "sources",
    "surroundings",
    "sweep",
    "sweep_many",
    "synthetic",
    "transform_walk",
    "turning_angles",
    "vertex_labels",
    "wave_kernel_signature",
]

# Public name -> module that defines it; each is imported when it is first used.
_HOME = {
    "Added": "spem.index.adding",
    "Answer": "spem.retrieval.ranking",
    "Answers": "spem.index.answers",
    "BlockLanczos": "spem.fields.solvers.lanczos",
    "BoundaryResponse": "spem.embedding.boundary_response",
    "Classification": "spem.retrieval.classification",
    "ClusterError": "spem.errors",
    "Clusters": "spem.decomposition.clusters",
    "Codes": "spem.codes.codes",
    "ConjugateGradient": "spem.fields.solvers.cg",
    "ConvergenceError": "spem.errors",
    "CreaturePoses": "spem.shapes.landmarks",
    "Cuda": "spem.fields.solvers.cuda.device",
    "Cuts": "spem.shapes.shape",
    "Direct": "spem.fields.solvers.direct",
    "ErrorCurve": "spem.decomposition.choice",
    "Estimate": "spem.fields.walks.intervals",
    "ExplicitIteration": "spem.fields.solvers.explicit",
    "Failure": "spem.codes.codes",
    "Hyperfield": "spem.fields.hyperfield",
    "Index": "spem.index.index",
    "LabelError": "spem.errors",
    "Maps": "spem.embedding.maps",
    "MatchedParts": "spem.decomposition.matched",
    "Model": "spem.codes.model",
    "ModelError": "spem.errors",
    "MultigridGradients": "spem.fields.solvers.gradients",
    "NodalMoments": "spem.codes.moments",
    "NonnegativeSparseCoding": "spem.decomposition.sparse_coding",
    "ParameterError": "spem.errors",
    "Parts": "spem.decomposition.parts",
    "PrecisionRecall": "spem.retrieval.evaluation",
    "QueueFullError": "spem.errors",
    "ReadError": "spem.errors",
    "Report": "spem.shapes.shape",
    "SandboxError": "spem.errors",
    "Scores": "spem.retrieval.evaluation",
    "Settings": "spem.codes.settings",
    "Shape": "spem.shapes.shape",
    "ShapeError": "spem.errors",
    "SizeError": "spem.errors",
    "Solution": "spem.fields.solvers.protocol",
    "SourceFields": "spem.fields.superposition.fields",
    "SourceHyperfield": "spem.fields.superposition.hyperfield",
    "Sources": "spem.fields.boundary.sources",
    "Spectrum": "spem.fields.spectrum",
    "SpemError": "spem.errors",
    "Streamlines": "spem.fields.streamlines",
    "SurfaceSpectrum": "spem.fields.surface_spectrum",
    "Sweep": "spem.fields.solvers.sweep",
    "Transient": "spem.fields.walks.transient",
    "VLAD": "spem.codes.vlad",
    "Vocabulary": "spem.codes.vocabulary",
    "Walk": "spem.fields.walks.killed",
    "arriving_walk": "spem.fields.walks.conditioned",
    "boundary_contexts": "spem.embedding.boundary_contexts",
    "boundary_response": "spem.embedding.boundary_response",
    "boundary_surface": "spem.shapes.boundary_surface",
    "bulls_eye": "spem.retrieval.evaluation",
    "classify": "spem.collections",
    "cluster_interactions": "spem.decomposition.clusters",
    "correlation_distance": "spem.retrieval.distances",
    "correspond": "spem.embedding.correspondence",
    "creature_poses": "spem.shapes.landmarks",
    "creatures": "spem.shapes.creatures",
    "diffusion_distance": "spem.embedding.heat",
    "distance_to_boundary": "spem.fields.boundary_distance",
    "encode": "spem.collections",
    "error_curve": "spem.decomposition.choice",
    "estimate_field": "spem.fields.walks.estimate",
    "evaluate": "spem.collections",
    "field": "spem.api.fields",
    "fuse": "spem.retrieval.distances",
    "fusion_weights": "spem.codes.joining",
    "heat_kernel": "spem.embedding.heat",
    "heat_kernel_signature": "spem.embedding.signatures",
    "hu_moments": "spem.codes.moments",
    "inner_distance_shape_context": "spem.embedding.shape_context",
    "inner_distances": "spem.fields.geodesics",
    "iso_contours": "spem.fields.isocontours",
    "iso_surfaces": "spem.fields.isocontours",
    "join_codes": "spem.codes.joining",
    "joint_parts": "spem.decomposition.joint",
    "killed_walk": "spem.fields.walks.killed",
    "level_curvature": "spem.fields.level_curves",
    "linear_svm": "spem.retrieval.classification",
    "maps": "spem.api.fields",
    "match_nodes": "spem.embedding.correspondence",
    "match_parts": "spem.decomposition.matching",
    "nodal_clusters": "spem.embedding.nodal",
    "nodal_domains": "spem.embedding.nodal",
    "nodal_thresholds": "spem.embedding.nodal",
    "node_correlation": "spem.decomposition.interactions",
    "of_one_size": "spem.retrieval.sizes",
    "parts": "spem.api.parts",
    "precision_recall": "spem.retrieval.evaluation",
    "read": "spem.shapes.read",
    "read_all": "spem.shapes.read",
    "rerank": "spem.retrieval.diffusion",
    "sample_paths": "spem.fields.walks.paths",
    "scale_invariant_signature": "spem.embedding.signatures",
    "screened_distance": "spem.fields.boundary_distance",
    "search": "spem.collections",
    "shape_context": "spem.embedding.shape_context",
    "shared_times": "spem.embedding.signatures",
    "shared_values": "spem.embedding.signatures",
    "signed_distance_shape": "spem.shapes.levels",
    "size_distance": "spem.retrieval.sizes",
    "solve_spectrum": "spem.fields.spectrum",
    "solve_surface_spectrum": "spem.fields.surface_spectrum",
    "solve_transient": "spem.fields.walks.transient",
    "source_correlation": "spem.decomposition.interactions",
    "source_distances": "spem.fields.geodesics",
    "source_fields": "spem.api.parts",
    "source_gradient": "spem.fields.gradients",
    "source_node_correlation": "spem.decomposition.interactions",
    "source_streamlines": "spem.fields.streamlines",
    "source_walk": "spem.fields.walks.conditioned",
    "sources": "spem.api.parts",
    "surroundings": "spem.embedding.correspondence",
    "sweep": "spem.api.fields",
    "sweep_many": "spem.api.fields",
    "synthetic": "spem.shapes.synthetic",
    "transform_walk": "spem.fields.walks.conditioned",
    "turning_angles": "spem.fields.level_curves",
    "vertex_labels": "spem.decomposition.transfer",
    "wave_kernel_signature": "spem.embedding.signatures",
}

# Type checkers read the imports above, and would take any name for one of this function's.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            msg = f"module 'spem' has no attribute {name!r}"
            raise AttributeError(msg)
        module = importlib.import_module(_HOME[name])
        value = module if name in ("creatures", "synthetic") else getattr(module, name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return __all__
