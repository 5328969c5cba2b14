"""What is true of every shape: every file of the folder that is found is checked here by itself."""

import gc
import weakref
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
import trimesh
from pydantic import TypeAdapter

from ldtrefl import InputError
from ldtrefl.base import budget
from ldtrefl.scene import shapes
from ldtrefl.scene.shapes import base

FINEST_CLOSED = 400_000
"""Triangles of a mesh that is welded here: a second's work."""


def welded(name: str, params: dict[str, object] | None = None) -> trimesh.Trimesh:
    """The shape with one vertex in a place."""
    mesh = shapes.make(name, params)
    places, inverse = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return trimesh.Trimesh(places, inverse.reshape(-1)[mesh.faces], process=False)


def schema_of(name: str, parameter: str) -> dict[str, Any]:
    """The limits of a parameter as JSON Schema says them."""
    return TypeAdapter(get_type_hints(shapes.all_shapes()[name].make, include_extras=True)[parameter]).json_schema()


def beyond(schema: dict[str, Any]) -> object:
    """A value above the limits of a parameter."""
    if "prefixItems" in schema:
        return [beyond(entry) for entry in schema["prefixItems"]]
    if "items" in schema:
        return [beyond(schema["items"])] * schema["minItems"]
    return {"boolean": 1, "integer": 10**9, "number": 1e30}[schema["type"]]


def largest(schema: dict[str, Any]) -> object:
    """The largest value that a parameter may have."""
    if "prefixItems" in schema:
        return [largest(entry) for entry in schema["prefixItems"]]
    return schema["maximum"]


PARAMETERS = [(name, parameter) for name, shape in shapes.all_shapes().items() for parameter in shape.parameters]


def test_a_shape_is_a_file_of_its_name() -> None:
    folder = Path(shapes.__file__).parent
    assert shapes.names() == sorted(shapes.names()) and len(shapes.names()) >= 12
    for name, shape in shapes.all_shapes().items():
        assert (folder / f"{name}.py").is_file() and shape.make.__doc__


@pytest.mark.parametrize("name", shapes.names())
def test_closed_or_open(name: str) -> None:
    shape = shapes.all_shapes()[name]
    assert len(shapes.make(name).faces) <= FINEST_CLOSED, "by default a shape is smooth, not heavy"
    mesh = welded(name)
    assert mesh.is_watertight == shape.is_closed
    if shape.is_closed:
        assert mesh.is_winding_consistent and (mesh.volume < 0) == shape.inwards


@pytest.mark.parametrize("name", shapes.names())
def test_size_place_and_normals(name: str) -> None:
    mesh = shapes.make(name)
    low, high = mesh.bounds
    np.testing.assert_allclose(np.abs([low, high]).max(), shapes.all_shapes()[name].reach, rtol=1e-3)
    np.testing.assert_allclose(low + high, 0.0, atol=2e-3)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    assert (np.linalg.norm(facets, axis=1) > 0).all()
    assert ((facets * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) > 0).mean() > 0.99
    if mesh.uvs is not None:
        assert mesh.uvs.min() >= 0.0 and mesh.uvs.max() <= 1.0


@pytest.mark.parametrize("name", shapes.names())
def test_the_estimate_counts_the_triangles(name: str) -> None:
    assert_estimate_holds(name, {})


def assert_estimate_holds(name: str, params: dict[str, object]) -> None:
    """At least the bytes a triangle that were measured, and not many times as many: some surfaces are cut."""
    shape = shapes.all_shapes()[name]
    with budget.account() as account:
        mesh = shapes.make(name, params)
    known = mesh.stored_normals is not None
    per_triangle = base.KNOWN_NORMALS_BYTES if known else base.MADE_NORMALS_BYTES
    estimate = account.taken - base.FIXED_BYTES
    grid = shape.checked(**params).get("grid", 0)
    assert per_triangle * len(mesh.faces) <= estimate * 1.02
    assert estimate <= 4.0 * per_triangle * len(mesh.faces) + grid**3 * base.CELL_BYTES


@pytest.mark.parametrize("name", shapes.names())
def test_a_shape_beyond_the_budget_is_refused_before_it_is_made(name: str, small_limit: None) -> None:
    shape = shapes.all_shapes()[name]
    params = {parameter: largest(schema_of(name, parameter)) for parameter in shape.smaller}
    keys = " and ".join(rf"params\.{parameter}" for parameter in shape.smaller)
    message = rf"the shape '{name}' needs .* [MG]iB, allowed are 1\.0 MiB \({keys} or --memory changes that\)"
    with pytest.raises(InputError, match=message):
        shapes.make(name, params)


@pytest.mark.parametrize(("name", "parameter"), PARAMETERS, ids=[".".join(pair) for pair in PARAMETERS])
def test_a_parameter_has_a_default_and_limits(name: str, parameter: str) -> None:
    shape = shapes.all_shapes()[name]
    schema, default = schema_of(name, parameter), shape.checked()[parameter]
    assert shape.checked(**{parameter: default})[parameter] == default
    for value in (beyond(schema), "x", float("nan"), None, {}):
        with pytest.raises(InputError, match=f"^params: {parameter}"):
            shapes.make(name, {parameter: value})


@pytest.mark.parametrize("name", shapes.names())
def test_what_is_no_parameter_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"^params: unknown key 'colour' \(allowed: "):
        shapes.make(name, {"colour": 1})


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("spher", {}, "unknown shape 'spher'; did you mean 'sphere'"),
        ("sphere", {"segment": 4}, "unknown key 'segment'; did you mean 'segments'"),
        ("torus", {"minor": "x"}, "^params: minor: should be a valid number, got 'x'"),
        ("torus", {"minor": -0.5}, r"^params: minor: should be greater than 0, got -0\.5"),
        ("box", {"segments": 10**9}, "^params: segments: should be less than or equal to 4096, got 1000000000"),
        ("bowl", {"closed": 1}, "^params: closed: should be a valid boolean, got 1"),
        ("genus3", {"grid": float("nan")}, "^params: grid: should be a valid integer, got nan"),
    ],
)
def test_a_fault_is_named_in_one_line(name: str, params: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        shapes.make(name, params)


def test_equal_calls_share_a_mesh() -> None:
    mesh = shapes.make("torus", {"segments": [10, 6]})
    assert shapes.make("torus", {"segments": np.array([10, 6])}) is mesh is not shapes.make("torus")


def test_a_shape_goes_when_nobody_uses_it() -> None:
    mesh = weakref.ref(shapes.make("torus_knot", {"segments": [50, 7]}))
    gc.collect()
    assert mesh() is None
