"""The files both sides are tested against; they are beside the rover's Rust tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).resolve().parents[3] / "vehicles" / "rover" / "tests" / "vectors"


def load(name: str) -> Any:
    """The values of one file."""
    return json.loads((_FOLDER / name).read_text(encoding="utf-8"))
