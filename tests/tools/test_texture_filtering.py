"""The tool that measures how textures are filtered: its quick run, and what it measures by."""

import numpy as np
import pytest
import texture_filtering


def test_a_quick_run_finds_filtered_frames_better(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["texture_filtering.py", "--quick"])
    texture_filtering.main()
    _, *lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(texture_filtering.VIEWS) * len(texture_filtering.WAYS)
    errors = {line[:29].strip(): float(line.split()[-2]) for line in lines}
    for view in texture_filtering.VIEWS:
        for samples in ("1 sample", "4 samples"):
            name = f"{view:8} {samples}"
            assert errors[f"{name}, filtered"] < 0.6 * errors[name], errors


def test_energy_is_that_of_the_waves_in_a_picture() -> None:
    x = np.arange(64)
    waves = 3.0 * np.sin(2 * np.pi * x / 8) + np.sin(2 * np.pi * x / 2.0 + 1.0) / np.sin(1.0)
    image = np.broadcast_to(waves[None, :, None], (64, 64, 3))
    whole = np.ones((64, 64))
    assert texture_filtering.energy(image, whole, 4.0) == pytest.approx(1.0 / (4.5 + 1.0))


def test_blended_pixels_keep_the_mean() -> None:
    image = np.random.default_rng(0).uniform(size=(24, 24, 3))
    flat = texture_filtering.blended(np.full((24, 24, 3), 0.3), 4)
    np.testing.assert_allclose(flat, np.full((6, 6, 3), 0.3), rtol=1e-12)
    assert texture_filtering.blended(image, 4).mean() == pytest.approx(0.5, abs=0.03)
