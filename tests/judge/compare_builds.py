#!/usr/bin/env python3
"""Run random decks of the judge by two builds of the program, and tell where they differ.

    tests/judge/compare_builds.py BEFORE AFTER [--decks one=120 bodies=80] [--keep FOLDER]

For a change that should not change results, as one that takes a fallback out: exit status, the
resultants of all contact pairs and the strain energy in each increment, and the time of the
processor. Outcomes of BEFORE are kept in FOLDER, where later comparisons find them. Exit status 1
if a deck ends otherwise, or with other numbers.
"""

import argparse
import hashlib
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy is loaded

import h5py
import numpy as np
from judge import FAMILIES
from scenes import write_deck

LIMIT = 60  # seconds of the processor that a run may take
DECKS = ("one=120", "bodies=80", "joined=80", "rims=60", "finite=30")


def outcome(program, family, seed):
    """What a deck comes to: exit status, numbers, seconds of the processor, the last words."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder, "deck.inp")
        write_deck(FAMILIES[family](seed), deck)
        with subprocess.Popen(
            [program, deck.name], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
        ) as child:  # fmt: skip
            words = child.stderr.read()
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        return {
            "status": child.returncode,
            **numbers(deck.with_suffix(".vtkhdf")),
            "seconds": usage.ru_utime + usage.ru_stime,
            "words": words.strip()[-300:],
        }


def numbers(path):
    """Lists of resultants and energies, one number behind the other, and the solvers that ran."""
    if not path.exists():
        return {"resultants": [], "energy": [], "stages": 0}
    with h5py.File(path) as file:
        rows = slice(0, int(file["history"].attrs["finished"]))
        found = [pair["resultant"][rows].ravel() for pair in file.get("contact", {}).values()]
        return {
            "resultants": np.concatenate([[], *found]).tolist(),
            "energy": file["history/energy/strain"][rows].tolist(),
            "stages": int(file["history/solver_stages"][rows].max(initial=0)),
        }


def outcomes(program, decks, keep):
    """Outcomes by "family seed", from the folder where that has them."""
    code = hashlib.sha256(Path(program).read_bytes()).hexdigest()[:16]
    kept = keep / f"{code}.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    for family, seed in decks:
        name = f"{family} {seed}"
        if name not in known:
            known[name] = outcome(program, family, seed)
            kept.write_text(json.dumps(known))
    return known


def difference(a, b):
    """Largest difference of two lists beside the largest number; infinite if lengths differ."""
    if len(a) != len(b):
        return np.inf
    a, b = np.array(a), np.array(b)
    return float(np.abs(a - b).max() / max(np.abs(a).max(), 1e-300)) if a.size else 0.0


def compare(before, after, tolerance):
    """Words on two outcomes that are not alike; none if they are."""
    if before["status"] != after["status"]:
        return f"exit status {before['status']}, then {after['status']}: {after['words']}"
    if before["status"] != 0:
        return ""
    found = {what: difference(before[what], after[what]) for what in ("resultants", "energy")}
    worst = max(found, key=found.get)
    return f"{worst} differ by {found[worst]:.1e}" if found[worst] > tolerance else ""


def main():
    """Compare, print what differs and sums."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", help="a program")
    parser.add_argument("after", help="another one")
    parser.add_argument("--decks", nargs="+", default=DECKS, help="FAMILY=COUNT, seeds from 1")
    parser.add_argument("--seed", type=int, default=1, help="the first")
    parser.add_argument("--tolerance", type=float, default=1e-10, help="of forces and energies")
    parser.add_argument(
        "--keep", type=Path, default=Path(tempfile.gettempdir(), "outcomes"), help="a folder"
    )
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    groups = (words.split("=") for words in options.decks)
    decks = [(f, options.seed + k) for f, count in groups for k in range(int(count))]
    programs = (options.before, options.after)
    before, after = (outcomes(os.path.abspath(p), decks, options.keep) for p in programs)
    n_differ = 0
    for deck in decks:
        name = " ".join(map(str, deck))
        words = compare(before[name], after[name], options.tolerance)
        n_differ += bool(words)
        if words:
            print(f"{name}: {words}")
    for what, of in zip(("before", "after"), (before, after), strict=True):
        chosen = [of[" ".join(map(str, deck))] for deck in decks]
        print(
            f"{what}: {sum(o['status'] == 0 for o in chosen)} of {len(chosen)} solved, "
            f"{sum(o['stages'] > 1 for o in chosen)} by a fallback, "
            f"{sum(o['seconds'] for o in chosen):.0f} s of the processor"
        )
    return int(n_differ > 0)


if __name__ == "__main__":
    sys.exit(main())
