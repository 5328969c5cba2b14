"""The tool that measures what each skip is worth: its quick run, never its times."""

import json
import subprocess
import sys
from pathlib import Path

from ldtrefl.frame.skip_options import skip_names

ROOT = Path(__file__).parent.parent.parent


def test_ablation_writes_what_it_promises(tmp_path: Path) -> None:
    """The shape of the output, and that no skip changes a picture."""
    command = [sys.executable, str(ROOT / "tools" / "ablation.py"), "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "ablation.json").read_text())
    assert {row["skip"] for row in result["skips"]} == set(skip_names())
    assert all(row["same"] for row in result["skips"])
    assert result["culling"] and all(row["handed"] > 0 for row in result["culling"])
    assert all(row["lost"]["safe"] == 0 for row in result["culling"])
    assert all(row["handed"] <= 1.5 * row["entering"] for row in result["culling"])
