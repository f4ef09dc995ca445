"""Run sweeps and codes of small shapes in the simulator under g++'s sanitizers of addresses and behaviour.

A read or write outside an array, or a barrier that some threads do not reach, ends it with the line of the
kernel. Needs g++ on x86-64; takes a minute.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

#: Fields and codes are compared with the host's to this share of the largest value.
TOLERANCE = 1e-4

PROGRAM = """
import sys
import numpy as np
import spem
from simulator import Simulated
from spem.codes.batches import encode_shapes
from spem.fields.solvers.host import Host

def compare(what, found, wanted):
    error = np.abs(found - wanted).max() / np.abs(wanted).max()
    print(f"{what}: {error:.1e} from the host's", flush=True)
    if error > float(sys.argv[1]):
        sys.exit(1)

device = Simulated("shuffled", sanitize=True)
disks = [spem.synthetic.disk(radius, 1.0) for radius in (14.0, 40.0)]
for shape in (*disks, spem.synthetic.ball(6.0, 1.0)):
    compare(shape, *(spem.sweep(shape, n_rho=16, device=one).fields() for one in (device, None)))
model = spem.encode(disks, features="spem", n_rho=16, n_centers=4).model
codes = [encode_shapes(disks, model, device=one) for one in (device, Host())]
compare("codes", *codes)
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
