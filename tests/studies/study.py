"""What tests of studies share: where these are, the program, packages that they need."""

import importlib
import os
import sys
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("BIPOT", ROOT / "build" / "bipot"))
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT)]


def need(*packages):
    """End as a skipped test where one of the packages is not installed."""
    for package in packages:
        try:
            importlib.import_module(package)
        except ImportError as error:
            print(f"skipped: {error}")
            sys.exit(77)
