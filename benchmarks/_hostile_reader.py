"""Reads hostile files one after another, within limits, and says on a line of JSON what came of each.

``python _hostile_reader.py FOLDER FIRST``: of the files ``0000.png``, ``0001.obj``, ... of a folder all from
FIRST on.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from spem.codes.codes import Codes
from spem.errors import SpemError
from spem.shapes import synthetic
from spem.shapes.read import read_all
from spem.shapes.shape import Shape

MEMORY = 1 << 30
VOXELS = 4_000
_LONGEST = 1_000


def main() -> None:
    folder, first = Path(sys.argv[1]), int(sys.argv[2])
    warm_up(folder)
    size = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY,) * 2)
    os.environ["SPEM_MEMORY_LIMIT"] = str(MEMORY // 2)
    opened: list[str] = []
    sys.addaudithook(lambda event, arguments: opened.append(str(arguments[0])) if event == "open" else None)
    for file in sorted(folder.glob("[0-9]*"))[first:]:
        opened.clear()
        began = time.perf_counter()
        outcome, told = attempt(file)
        strange = [name for name in opened if "canary" in name or "passwd" in name or name.startswith("/dev")]
        record = {
            "file": file.name,
            "outcome": f"finding: opened {strange[0]}" if strange else outcome,
            "told": told[:300],
            "seconds": time.perf_counter() - began,
            "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10,
        }
        print(json.dumps(record), flush=True)


def warm_up(folder: Path) -> None:
    """Load all readers and kernels, so that limits and times are of the files alone."""
    for name in sorted(folder.glob("warm.*")):
        read_all(name, voxels=VOXELS)
    read_all(folder / "warm.png")
    synthetic.ball(1.0, 0.5)


def attempt(file: Path) -> tuple[str, str]:
    """Read a file; say what came of it."""
    reader: Callable[[Path], object] = Codes.load if file.suffix == ".spem" else read_shapes
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            reader(file)
    except SpemError as error:
        return verdict(str(error)), str(error)
    except MemoryError:
        return "finding: MemoryError", ""
    except BaseException as error:  # noqa: BLE001 that is what is looked for
        return f"finding: {type(error).__name__}", str(error)
    numeric = [str(one.message) for one in caught if issubclass(one.category, RuntimeWarning)]
    return ("finding: RuntimeWarning", numeric[0]) if numeric else ("shape", "")


def read_shapes(file: Path) -> list[Shape]:
    """Read all shapes of a file, and make sure that they are sound."""
    shapes = read_all(file, voxels=VOXELS)
    for shape in shapes:
        if not (shape.n_nodes > 0 and 0 < shape.volume < np.inf):
            msg = f"{shape} has a volume of {shape.volume}"
            raise RuntimeError(msg)
    return shapes


def verdict(message: str) -> str:
    """Return whether a message is one that can be shown to who sent the file."""
    if "\n" in message or not message.isprintable():
        return "finding: message of several lines"
    if len(message) > _LONGEST:
        return "finding: long message"
    return "refused"


if __name__ == "__main__":
    main()
