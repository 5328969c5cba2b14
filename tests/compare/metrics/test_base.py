"""Metrics are found by scanning, and say what they need by their parameters."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ldtrefl.compare import metrics
from ldtrefl.compare.metrics.base import Comparison, metric
from tests.compare.metrics.images import noise

TOY = '''
"""The largest difference of radiance."""

import numpy as np

from ldtrefl.compare.metrics.base import metric


@metric("largest", heading="largest", format=".2f", place=15)
def largest_difference(image: np.ndarray, reference: np.ndarray) -> float:
    return float(np.abs(image - reference).max())
'''


@pytest.fixture
def toy_metric(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A metric in a file of its own."""
    (tmp_path / "toy_of_a_test.py").write_text(TOY)
    monkeypatch.setattr(metrics, "__path__", [*metrics.__path__, str(tmp_path)])
    metrics.all_metrics.cache_clear()
    yield
    metrics.all_metrics.cache_clear()


def comparison() -> Comparison:
    return Comparison(noise(), 0.5 * noise(), np.ones((20, 30), bool))


def test_they_stand_in_order_and_have_names_of_their_own() -> None:
    found = metrics.all_metrics()
    assert found[0].name == "ssim"
    assert [m.place for m in found] == sorted(m.place for m in found)
    headings = [m.heading for m in found if m.heading is not None]
    assert len(set(headings)) == len(headings)
    assert all(m.__doc__ and format(0.5, m.format) for m in found)


def test_every_file_has_one() -> None:
    files = {path.stem for path in Path(metrics.__file__).parent.glob("*.py")} - {"__init__", "base"}
    assert {m.function.__module__.rpartition(".")[2] for m in metrics.all_metrics()} == files


@pytest.mark.usefixtures("toy_metric")
def test_a_new_file_is_a_new_metric() -> None:
    found = {m.name: m for m in metrics.all_metrics()}
    assert list(found).index("ssim") < list(found).index("largest") < list(found).index("psnr")
    assert found["largest"].of(comparison()) == pytest.approx(0.5 * noise().max())


def test_it_is_left_out_where_something_is_missing() -> None:
    found = {m.name: m.of(comparison()) for m in metrics.all_metrics()}
    assert found["wrong_hits"] is None and found["pixels"] is None and found["ssim"] is not None


def test_it_can_be_called_as_the_function_that_it_was() -> None:
    @metric("twice", heading=None, format="")
    def twice(mask: np.ndarray, image: float = 1.0) -> float:
        """Twice."""
        return 2.0 * image

    assert twice(np.zeros(1), 3.0) == 6.0 and twice(np.zeros(1), image=4.0) == 8.0
    assert twice.__doc__ == "Twice." and twice.needs == ("mask", "image")


def test_what_no_comparison_has_is_refused_when_it_is_made() -> None:
    with pytest.raises(TypeError, match=r"metric 'odd': no comparison has 'depth' \(there are image, reference, mask"):

        @metric("odd", heading=None, format="")
        def odd(depth: float) -> float:
            return depth
