"""Build source archive and wheel, install the wheel in an environment of its own, start what it brings."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROGRAM = "import spem; [getattr(spem, name) for name in spem.__all__]; print(spem.__file__)"


def main() -> None:
    """Exit with the status of the first step that fails."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        _run(sys.executable, "-m", "build", "--sdist", "--wheel", "--outdir", folder, ROOT)
        (wheel,) = here.glob("*.whl")
        (archive,) = here.glob("*.tar.gz")
        with zipfile.ZipFile(wheel) as packed, tarfile.open(archive) as source:
            _require_kernels(packed.namelist(), source.getnames())
        venv.create(here / "venv", with_pip=True)
        python = here / "venv" / "bin" / "python"
        _run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
        _run(python, "-I", "-c", PROGRAM, cwd=here)
        program = here / "venv" / "bin" / "spem"
        _run(program, "--help", cwd=here)
        _run(program, "paper", "fig1", "--quick", "-o", here / "paper", cwd=here)


def _require_kernels(*listings: list[str]) -> None:
    """Exit where a CUDA source of the package is not in the wheel or in the archive."""
    sources = [
        str(path.relative_to(ROOT / "src")) for path in (ROOT / "src").rglob("*.cu*") if path.is_file()
    ]
    for names in listings:
        missing = [source for source in sources if not any(name.endswith(source) for name in names)]
        if missing or not sources:
            sys.exit(f"{', '.join(missing) or 'every CUDA source'} is missing from what was built")


def _run(*command: str | Path, cwd: Path = ROOT) -> None:
    """Run one step; its output is shown where it fails."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")


if __name__ == "__main__":
    main()
