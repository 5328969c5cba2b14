"""Options, devices and threads that are not allowed: one line that says what is."""

import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Object, Scene


def test_wrong_options_threads_and_devices() -> None:
    scene = Scene(camera=Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4), objects=(Object(shape="box"),))
    for options, message in [
        ({"resolution": 8}, "resolution: .*greater than or equal to 16, got 8"),
        ({"resolutoin": 64}, "unknown option of method ldt 'resolutoin'; did you mean 'resolution'"),
        ({"search": "spiral"}, "method ldt: search: should be 'exact' or 'linear', got 'spiral'"),
        ({"method": "lidt"}, "unknown method 'lidt'; did you mean 'ldt'"),
        ({"device": "cuda:99"}, "no device 'cuda:99'"),
    ]:
        with pytest.raises(ldtrefl.InputError, match=message):
            ldtrefl.render(scene, **options)
    for threads in (0, -1, 2.5, "two", True):
        with pytest.raises(ldtrefl.InputError, match=rf"threads must be a whole number from 1 to \d+, got {threads!r}"):
            ldtrefl.set_threads(threads)
