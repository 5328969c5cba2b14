"""The page that compares all methods: what it takes from methods' files, its figures, and its wipe in Chromium."""

from __future__ import annotations

import base64
import dataclasses
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from comparison import RESULTS, SCENES, scene_names
from comparison_parts.entries import TRUTH, Entry, entries, failings_in
from comparison_parts.measuring import Figures, Outcome, SceneOutcome, compared, fitted
from comparison_parts.page import Circumstances, page
from comparison_parts.pictures import difference_uri, picture_uri
from comparison_parts.summary import fastest, overall, wins
from comparison_parts.words import escaped, paragraphs
from PIL import Image

import ldtrefl
from ldtrefl.methods import all_methods
from tests.tools.chromium import Page, browser, new_page

SIZE = 96, 64
COLORS = {TRUTH: (1.0, 0.0, 0.0), "envmap": (0.0, 0.0, 1.0), "ldt": (0.0, 1.0, 0.0)}
"""What the methods of a made-up scene paint."""
FIGURES = Figures(10.0, 5.0, 1_000_000, 2_000_000, ssim=1.0, flip=0.0, ssim_of_one=None, wrong=0.0)


def plain_entries() -> list[Entry]:
    """Four methods, as they are by default: one refuses the made-up scenes."""
    return [entry for entry in entries(["ldt", "envmap", "planar"]) if not entry.option]


def made_up(name: str, **changes: dict[str, float]) -> SceneOutcome:
    """A scene in which each method paints its colour, and ``planar`` refuses; figures of a method may be changed."""
    found = {
        label: Outcome(
            figures=dataclasses.replace(FIGURES, **changes.get(label, {})),  # type: ignore[arg-type]
            picture=np.full((SIZE[1], SIZE[0], 3), color, np.float32),
        )
        for label, color in COLORS.items()
    }
    return SceneOutcome(name, "3 objects", found | {"planar": Outcome("object 'ball' is <round>")})


def written(*outcomes: SceneOutcome) -> str:
    return page(outcomes, plain_entries(), Circumstances("a machine", 2, SIZE, ("x, whose meshes are missing",)))


# --- What methods' files say


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.label)
def test_every_method_says_when_to_choose_it_and_what_it_fails_at(entry: Entry) -> None:
    assert len(entry.purpose) > 20
    assert "Fails" in entry.failings[0] and len(entry.failings[0]) > 20
    assert set(entry.options) <= set(entry.method.options())


def test_every_method_is_shown_the_truth_first() -> None:
    assert entries()[0].label == TRUTH
    assert {entry.method.name for entry in entries()} == set(all_methods())
    assert {"tessellation", "tessellation crack_free=true", "ldt search=linear"} <= {each.label for each in entries()}
    assert [entry.label for entry in entries(["planar"])] == [TRUTH, "planar"]
    with pytest.raises(ldtrefl.InputError, match="unknown method 'plana'; did you mean 'planar'"):
        entries(["plana"])


def test_methods_that_are_asked_for_bounces_know_more_than_one_reflection() -> None:
    more = {entry.method.name for entry in entries() if not entry.knows_one_reflection}
    assert more == {"bvh", "ldt"}


def test_failings_are_the_rest_of_the_file_or_the_item_of_the_options_value() -> None:
    rest = "A method.\n\nIt fails never.\n\nFails, as said:\n\n- here;\n- there.\n\nAlso there."
    assert failings_in(rest) == failings_in(rest, "near") == ("Fails, as said:\n\n- here;\n- there.\n\nAlso there.", "")
    items = "A method.\n\n- ``near``: close. Fails: far\n  away.\n- ``far``: Fails: close by.\n\nBoth: coarse.\n\nMore."
    assert failings_in(items, "near") == ("``near``: close. Fails: far\n  away.", "Both: coarse.")
    assert failings_in(items, "far") == ("``far``: Fails: close by.", "Both: coarse.")
    assert failings_in("A method.") == ("", "")


def test_words_become_html() -> None:
    assert escaped("``a`` & `b` <c>") == "<code>a</code> &amp; <code>b</code> &lt;c&gt;"
    assert paragraphs("One\nline:\n\n- a\n  b\n- c") == "<p>One line:</p><ul><li>a b</li><li>c</li></ul>"


# --- Figures


def test_overall_figures_are_medians_and_the_worst() -> None:
    outcomes = [
        made_up("one", envmap={"ssim": 0.5, "first": 30.0, "later": 2.5, "peak": 8e6, "ssim_of_one": 0.6}),
        made_up("two", envmap={"ssim": 0.9, "first": 10.0, "later": 20.0, "peak": 4e6, "ssim_of_one": 0.9}),
        made_up("three", envmap={"ssim": 0.7, "first": 20.0, "later": 5.0, "peak": 6e6, "ssim_of_one": 0.7}),
    ]
    row = overall(outcomes, next(entry for entry in plain_entries() if entry.label == "envmap"))
    assert row is not None
    assert dataclasses.astuple(row) == ("envmap", 3, 0.7, 0.5, "one", 0.7, 0.6, 2.0, 1.0, 6e6)
    assert overall(outcomes, next(entry for entry in plain_entries() if entry.label == "planar")) is None


def test_only_good_methods_can_be_the_fastest() -> None:
    fast = {"later": 1.0}
    outcomes = [
        made_up("good", envmap=fast | {"ssim": 0.99}),
        made_up("bad", envmap=fast | {"ssim": 0.98}, ldt={"later": 2.0}),
        made_up("again", ldt=fast),
    ]
    assert [fastest(outcome, lambda figures: figures.later) for outcome in outcomes] == ["envmap", "ldt", "ldt"]
    assert wins(outcomes, lambda figures: figures.later) == [("ldt", 2), ("envmap", 1)]


def test_a_scene_by_three_methods() -> None:
    """The ray caster is the truth itself; a cube map is not; a ball is not flat."""
    scene = fitted(ldtrefl.load_scene(SCENES / "teapot.toml"), (96, 96))
    assert (scene.camera.width, scene.camera.height) == (96, 64)
    outcome = compared("teapot", scene, plain_entries())
    assert outcome.about == "5 objects, 1 of them mirrors; 52,790 triangles; 4 reflections"
    true, cube, planar = (outcome.by_label[label] for label in (TRUTH, "envmap", "planar"))
    assert true.figures is not None and cube.figures is not None
    assert (true.figures.ssim, true.figures.flip, true.figures.wrong) == (1.0, 0.0, 0.0)
    assert true.figures.ssim_of_one is None and true.picture.shape == (64, 96, 3)
    assert cube.figures.ssim < 0.9 and cube.figures.wrong is None and cube.figures.ssim_of_one is not None
    assert cube.figures.peak >= cube.figures.kept > 512 * 512 * 6 * 12 / 2  # half of its texels at least are new
    assert min(cube.figures.first, cube.figures.later) > 0.0
    assert planar.figures is None and "flat mirrors" in planar.refusal


def test_slow_methods_make_one_frame_that_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = fitted(ldtrefl.load_scene(SCENES / "wall.toml"), (24, 16))
    monkeypatch.setattr("comparison_parts.measuring.SLOW", 0.0)
    figures = compared("wall", scene, entries(["bvh"])).by_label[TRUTH].figures
    assert figures is not None and figures.later == figures.first > 0.0


def test_scenes_are_those_of_two_folders() -> None:
    assert {"teapot", "paper/kettle"} <= set(scene_names())
    assert not any(name.startswith(("gallery", "meshes")) for name in scene_names())


def decoded(uri: str) -> np.ndarray:
    return np.array(Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))))


def test_pictures_and_differences_of_one_colour() -> None:
    """Half of a display's white is 0.214 of its light; a quarter more of it is the scale's red end."""
    dark, light = (np.full((8, 16, 3), value, np.float32) for value in (0.21404, 0.52252))
    assert decoded(picture_uri(dark)).shape == (8, 16, 3)
    np.testing.assert_allclose(decoded(picture_uri(dark)), 127.5, atol=2)
    for image, color in ((dark, (128, 128, 128)), (light, (255, 0, 0))):
        shown = decoded(difference_uri(image, dark))
        assert shown.shape == (4, 8, 3)
        np.testing.assert_allclose(shown, np.broadcast_to(color, shown.shape), atol=6)


# --- The page


def test_the_page_says_who_refuses_and_what_is_missing_and_needs_no_other_file() -> None:
    text = written(made_up("one"))
    assert "object &#x27;ball&#x27; is &lt;round&gt;" in text and "<round>" not in text
    assert "x, whose meshes are missing" in text
    assert "Refuses 1 of the 1 scenes." in text
    assert 'src="data:image/webp;base64,' in text and "http" not in text.replace("http-equiv", "")


def test_the_page_says_which_methods_are_exact() -> None:
    bad = {"ssim": 0.9}
    outcomes = [made_up("one"), made_up("two", ldt=bad, envmap=bad | {"ssim_of_one": 1.0})]
    assert "takes: <code>ldt</code>, <code>envmap</code>" not in written(*outcomes)
    assert "takes: none; but for reflections of reflections: <code>envmap</code>." in written(*outcomes)
    assert "takes: <code>envmap</code>, <code>ldt</code>; but" in written(outcomes[0])


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    program = browser()
    if program is None:
        pytest.skip("no Chromium is found")
    with new_page(program, tmp_path_factory.mktemp("profile")) as found:
        yield found


BOX = "document.querySelector('.stage').getBoundingClientRect()"
SLIDER = "document.querySelector('.wipe input')"


def box_of_stage(window: Page) -> tuple[float, float, float, float]:
    """Left, top, width and height of the first wipe, which is brought into sight."""
    window.value("document.querySelector('.wipe').scrollIntoView()")
    left, top, width, height = (window.value(f"{BOX}.{side}") for side in ("left", "top", "width", "height"))
    return left, top, width, height


def colors_beside(window: Page, share: float) -> list[tuple[str, ...]]:
    """What the made-up methods' colours are to the left and to the right of a share of the wipe's width."""
    left, top, width, height = box_of_stage(window)
    row = window.picture()[round(top + height / 2)]
    names = dict(zip([0, 1, 2], "RGB", strict=True))
    columns = (round(left + width * (share + step)) for step in (-0.03, 0.03))
    return [names[int(row[column].argmax())] for column in columns]  # type: ignore[misc]


def test_the_wipe_moves_by_pointer_and_by_keys(window: Page, tmp_path: Path) -> None:
    file = tmp_path / "index.html"
    file.write_text(written(made_up("one"), made_up("two")), encoding="utf-8")
    window.resize(1280, 900)
    window.open(file)
    assert colors_beside(window, 0.5) == ["R", "B"]  # the truth, and the method that comes next
    left, top, width, height = box_of_stage(window)
    middle = top + height / 2
    window.drag([(left + 0.5 * width, middle), (left + 0.4 * width, middle), (left + 0.25 * width, middle)])
    assert window.value(f"{SLIDER}.value") == "25"
    assert colors_beside(window, 0.25) == ["R", "B"] and colors_beside(window, 0.5) == ["B", "B"]
    for _ in range(4):
        window.press("ArrowRight")
    assert window.value(f"{SLIDER}.value") == "27"
    window.press("ArrowLeft")
    assert window.value(f"{SLIDER}.value") == "26.5"
    for side, method in (("left", "envmap"), ("right", "ldt")):
        chosen = f"document.querySelector('.wipe select.{side}')"
        window.value(f"{chosen}.value = '{method}'; {chosen}.dispatchEvent(new Event('change'))")
    assert colors_beside(window, 0.265) == ["B", "G"]
    assert window.value("document.querySelectorAll('.wipe input')[1].value") == "50"
    assert window.errors == []


@pytest.mark.parametrize("width", [1280, 800])
def test_nothing_reaches_beyond_the_window(window: Page, tmp_path: Path, width: int) -> None:
    file = tmp_path / "index.html"
    file.write_text(written(made_up("one")), encoding="utf-8")
    for path in (file, RESULTS / "index.html"):
        window.resize(width, 900)
        window.open(path)
        assert window.value("document.documentElement.scrollWidth") <= width
        wide = "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth).length"
        assert window.value(wide) == 0


def test_the_page_that_is_shipped_opens_without_a_fault(window: Page) -> None:
    window.resize(1280, 900)
    window.open(RESULTS / "index.html")
    wipes, scenes = (f"document.querySelectorAll('{which}').length" for which in (".wipe", "section"))
    assert window.value(wipes) == window.value(scenes) > 20
    broken = "[...document.images].filter(image => !(image.complete && image.naturalWidth)).length"
    assert window.value(broken) == 0
    left, top, width, _ = box_of_stage(window)
    window.drag([(left + 0.5 * width, top + 9), (left + 0.75 * width, top + 9)])
    assert window.value(f"{SLIDER}.value") == "75"
    window.press("ArrowLeft")
    assert window.value(f"{SLIDER}.value") == "74.5"
    assert window.errors == []
