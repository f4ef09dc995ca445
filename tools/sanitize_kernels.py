"""Run sweeps of small shapes under the address and undefined-behaviour sanitizers of g++, in the simulator.

A read or write outside an array, or a barrier that some threads do not reach, ends it with the line of the
kernel. Needs g++ on x86-64; takes a minute.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

#: The sweep is compared with the host's to this share of the largest value.
TOLERANCE = 1e-5

PROGRAM = """
import sys
import numpy as np
import spem
from simulator import Simulated

device = Simulated("shuffled", sanitize=True)
for shape in (spem.synthetic.disk(14.0, 1.0), spem.synthetic.ball(6.0, 1.0)):
    found, wanted = (spem.sweep(shape, n_rho=16, device=one).fields() for one in (device, None))
    error = np.abs(found - wanted).max() / np.abs(wanted).max()
    print(f"{shape}: {error:.1e} from the host's", flush=True)
    if error > float(sys.argv[1]):
        sys.exit(1)
"""


def main() -> None:
    """Exit with the sanitizers' status, and their words."""
    from simulator.compiler import find_sanitizer, spawn_sanitized

    if find_sanitizer() is None:
        sys.exit("g++ with its address sanitizer, on x86-64, is needed")
    done = spawn_sanitized("-c", PROGRAM, str(TOLERANCE))
    sys.stdout.write(done.stdout)
    sys.stderr.write(done.stderr)
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
