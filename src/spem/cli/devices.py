"""``spem devices``: the CUDA devices that ``--device`` may name."""

from __future__ import annotations

from dataclasses import asdict

import typer

from spem.cli.options import Json
from spem.cli.output import print_json
from spem.errors import SpemError


def devices(json: Json = False) -> None:
    """List the CUDA devices of this machine, or tell why there is none.

    Sweeps over ρ, SPEM maps and their codes run on one of them with --device cuda or --device cuda:NUMBER.

    \b
    Examples:
      spem devices
      spem devices --json
    """  # noqa: D301
    from spem.fields.solvers.cuda.listing import list_devices

    try:
        found, reason = list_devices(), None
    except SpemError as error:
        found, reason = [], str(error)
    if json:
        print_json({"devices": [asdict(each) for each in found], "reason": reason})
        return
    if reason is not None:
        typer.echo(f"no CUDA device: {reason}")
    for each in found:
        memory = f"{_gib(each.total_bytes)} GiB, {_gib(each.free_bytes)} free"
        typer.echo(f"cuda:{each.index}  {each.name}  {memory}  compute capability {each.capability}")


def _gib(n_bytes: int) -> str:
    """Write a number of bytes in GiB."""
    return f"{n_bytes / 2**30:.1f}"
