"""Several threads that share renderers, or have one each: every frame is right."""

import pytest
from stress_cases.histories import OPTIONS, THREADS, difference, in_threads, sky, wrong_frames

import ldtrefl
from ldtrefl.renderer import Frame
from ldtrefl.scene import description as scene_module
from ldtrefl.scene.description import Object
from tests.frame_scenes import scene


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> str:
    return sky(tmp_path_factory.mktemp("sky"))


@pytest.mark.parametrize("by", ["ldt", "ldt, error", "bvh", "envmap"])
@pytest.mark.parametrize("count", [1, THREADS], ids=["one renderer", "one each"])
def test_threads_get_their_own_frames(by: str, count: int, picture: str) -> None:
    given_scene = scene(environment=scene_module.Environment(image=picture))
    method, options = OPTIONS[by]
    renderers = [ldtrefl.Renderer(given_scene, method, **options) for _ in range(count)]
    wrong, tried = wrong_frames(given_scene, by, renderers, 4)
    assert wrong == 0, f"{wrong} of {tried} frames"


def test_frames_and_moves_of_several_threads() -> None:
    """Every frame shows the scene before a move or after it, never something between."""
    renderer = ldtrefl.Renderer(scene(), "ldt")
    places = ((-1.4, -1.2, 0.2), (-1.0, -1.5, 0.0))
    moved = [ldtrefl.render(scene().with_object("torus", translate=place), "ldt") for place in places]
    frames: list[Frame] = []

    def draw() -> None:
        for _ in range(8):
            frames.append(renderer.render())

    def move() -> None:
        for k in range(40):
            renderer.move("torus", translate=places[k % 2])

    in_threads([draw, move, draw])
    assert len(frames) == 16
    assert all(any(difference(frame, truth) == "" for truth in moved) for frame in frames)


def test_renderers_are_made_by_several_threads() -> None:
    """Meshes and kernels are shared: the thread that needs them first makes them."""
    frames: list[Frame] = []
    params = {"segments": [90, 12]}

    def work() -> None:
        knot = Object(name="fresh", shape="torus_knot", params=params, scale=0.5, translate=(1.5, -1, 0))
        frames.append(ldtrefl.render(scene(objects=(scene().objects[0], knot)), "ldt", error=1.0))

    in_threads([work] * THREADS)
    assert len(frames) == THREADS and all(difference(frame, frames[0]) == "" for frame in frames)
