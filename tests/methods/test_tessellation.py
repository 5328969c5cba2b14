"""Adaptive tessellation: what coarse objects lose in a ball is won back, and holes are the paper's alone."""

import numpy as np

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.scene.description import Material, Object
from tests.methods.test_bisector import ball_scene

COARSE = ball_scene(
    Object(shape="plane", scale=4.0, translate=(0.0, 0.0, -1.0), material=Material(albedo=(0.7, 0.5, 0.3))),
    Object(shape="box", scale=(0.3, 0.3, 0.8), translate=(-1.4, -1.2, -0.2), rotate=(0, 0, 1, 30)),
)
"""A floor and a box, of 14 triangles."""


def test_most_of_what_is_lost_is_won_back_with_fewer_vertices_than_all() -> None:
    truth = ldtrefl.render(COARSE, "bvh", samples=1, max_bounces=1)
    mask = truth.reflector_mask
    frames = {
        "none": ldtrefl.render(COARSE, "bisector", samples=1),
        "adaptive": ldtrefl.render(COARSE, "tessellation", samples=1, crack_free=True),
        "full": ldtrefl.render(COARSE, "tessellation", samples=1, threshold=0.0),
    }
    ssim = {name: metrics.ssim(frame.image, truth.image, mask) for name, frame in frames.items()}
    assert ssim["none"] < 0.85 < 0.93 < ssim["full"]
    assert ssim["adaptive"] - ssim["none"] >= 0.8 * (ssim["full"] - ssim["none"])
    vertices = {name: frame.stats.counters["vertices"] for name, frame in frames.items()}
    assert vertices["none"] < vertices["adaptive"] < 0.5 * vertices["full"]


def test_no_hole_opens_where_edges_are_divided_by_their_own_errors() -> None:
    truth = ldtrefl.render(COARSE, "bvh", samples=1, max_bounces=1)
    assert truth.hits is not None

    def holes(**options: object) -> int:
        frame = ldtrefl.render(COARSE, "tessellation", samples=1, threshold=0.003, **options)
        assert frame.hits is not None and truth.hits is not None
        is_hole = (frame.hits.object < 0) & (truth.hits.object >= 0)
        # What is missing at the border of a reflection is no hole: all about a hole something is shown.
        shown = np.pad(frame.hits.object >= 0, 1)
        around = shown[:-2, 1:-1] & shown[2:, 1:-1] | shown[1:-1, :-2] & shown[1:-1, 2:]
        return int((is_hole & around).sum())

    assert holes(crack_free=True) == 0 < 5 < holes(crack_free=False)
