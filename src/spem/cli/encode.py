"""``spem encode``: the codes of a collection, with progress, and resumed where it stopped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.options import Device, Jobs, Json, find_device, tell_idle_device
from spem.cli.output import check_target, complain, counted, print_json
from spem.cli.progress import Bar
from spem.cli.settings_options import with_settings
from spem.errors import ModelError, ParameterError, ReadError

if TYPE_CHECKING:
    from spem.codes.codes import Codes, Failure
    from spem.codes.model import Model
    from spem.codes.settings import Settings
    from spem.fields.solvers.engine import Backend


@with_settings
def encode(
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATH", help="Files, folders with all below them, patterns."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="CODES", help="File of the codes.")],
    vocabulary: Annotated[
        Path | None, typer.Option(help="Model or codes whose vocabulary and settings are reused.")
    ] = None,
    save_vocabulary: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the model to a file of its own too.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Make CODES anew instead of adding to it.")
    ] = False,
    prune: Annotated[
        bool, typer.Option("--prune", help="Drop shapes of CODES whose files are no longer in PATH.")
    ] = False,
    *,
    options: dict[str, Any],
    paper: Annotated[bool, typer.Option("--paper", help="Settings of the paper, section 5.5.")] = False,
    jobs: Jobs = None,
    device: Device = "cpu",
    json: Json = False,
) -> None:
    """Make the codes of a collection.

    Features of each shape, a vocabulary learnt from them, and a code for each shape; a label volume gives one
    shape a label, with its size: --per-label where a segmentation does not look like one. Solids are coded by
    SPEM maps and surface, silhouettes by boundary sources and contours, unless --features says otherwise:
    kinds joined by +, of spem, surface, sources, shape-context, inner-distance,
    surface-wks, surface-si-hks, surface-hks, wks, si-hks, hks. Settings of maps need spem, and
    it alone is made on --device.
    Files that fail are told, one line each, and the others saved. When CODES is there already, new files are
    added with its vocabulary and settings, and what has not changed is reused. An interrupted run goes on
    from CODES.work when the same command is given again.

    \b
    Examples:
      spem encode shapes/ -o shapes.spem
      spem encode 'scans/**/*.off' -o scans.spem --voxels 60000 --jobs 4
      spem encode new/ -o new.spem --vocabulary shapes.spem
      spem encode shapes/ -o maps.spem --features spem
      spem encode seg.nii.gz -o objects.spem --per-label
      spem encode more/ -o shapes.spem                      adds to shapes.spem
      spem encode solids/ -o solids.spem --device cuda      maps on a GPU
    """  # noqa: D301
    from spem.codes.settings import Settings

    where = find_device(device)
    if not paper:
        Settings.of(options)
    for target in (output, save_vocabulary):
        if target is not None:
            check_target(target)
    codes, failures = encode_paths(
        paths,
        output,
        options,
        vocabulary=vocabulary,
        overwrite=overwrite,
        prune=prune,
        paper=paper,
        jobs=jobs,
        device=where,
    )
    tell_idle_device(device, codes.model.settings.features)
    if save_vocabulary is not None:
        codes.model.save(save_vocabulary)
    _tell(output, codes, failures, json=json)
    if failures:
        raise typer.Exit(1)


def encode_paths(
    paths: list[str],
    output: Path,
    options: dict[str, Any],
    *,
    vocabulary: Path | None = None,
    overwrite: bool = False,
    prune: bool = False,
    paper: bool = False,
    jobs: int | None = None,
    device: Backend | None = None,
) -> tuple[Codes, tuple[Failure, ...]]:
    """Encode files into a codes file, or add them to it.

    Parameters
    ----------
    paths
        Files, folders, patterns.
    output
        The codes file.
    options
        Settings that were asked for, by name.
    vocabulary
        Model or codes to reuse.
    overwrite
        Whether codes that are there already are left out of account.
    prune
        Whether shapes whose files are gone from `paths` are dropped from the codes.
    paper
        Whether settings that were not asked for are those of the paper.
    jobs
        Number of processes; by the number of shapes where None.
    device
        Where SPEM maps and their codes are made; the processor when None.

    Returns
    -------
    codes
        What was written.
    failures
        Of this run; the codes hold those of earlier ones too.

    Raises
    ------
    SpemError
        When nothing could be encoded.
    KeyboardInterrupt
        When interrupted, with a word on how to go on.
    """
    from spem.codes.codes import Codes
    from spem.codes.collection import encode_collection, merge
    from spem.codes.sources import count_hidden, find_files
    from spem.codes.work import clear_work
    from spem.codes.workers import count_processes
    from spem.shapes.kinds import kind_of

    hidden = count_hidden(paths)
    if hidden:
        complain(f"{counted(hidden, 'hidden file')} left out; give such files by name")
    files = [path for path in find_files(paths) if path.absolute() != output.absolute()]
    if overwrite and output.exists() and kind_of(output):
        msg = f"{output}: is {kind_of(output)}, not spem codes; write to another file"
        raise ParameterError(msg)
    known = Codes.load(output) if output.exists() and not overwrite else None
    model = _vocabulary(vocabulary, known, output)
    settings = _settings(options, model, output if known is not None else vocabulary, paper=paper)
    work = output.with_name(output.name + ".work")
    with Bar() as bar:
        try:
            codes = encode_collection(
                list(files),
                settings,
                model=model,
                known=known,
                n_jobs=jobs or count_processes(len(files)),
                work=work,
                progress=bar.advance,
                on_failure=bar.fail,
                device=device,
            )
            failures = codes.failures
            if known is not None:
                codes = merge(_present(known, paths, output, prune=prune), codes)
            codes.save(output)
        except ReadError as error:
            if error.failures:
                # nothing was done that another run could go on from
                clear_work(work)
            raise
        except KeyboardInterrupt:
            msg = f"interrupted; what is done is kept in {work}: give the same command again to go on"
            raise KeyboardInterrupt(msg) from None
    clear_work(work)
    return codes, failures


def _vocabulary(vocabulary: Path | None, known: Codes | None, output: Path) -> Model | None:
    """Return the model to reuse, if any: that of the codes that are there, and no other."""
    model = load_model(vocabulary) if vocabulary is not None else None
    if known is None:
        return model
    if model is not None and model.digest != known.model.digest:
        msg = f"{output}: is there already, made with another vocabulary than {vocabulary}; give --overwrite"
        raise ModelError(msg)
    return known.model


def _present(codes: Codes, paths: list[str], output: Path, *, prune: bool) -> Codes:
    """Tell how many shapes are gone from the paths; drop them if that is asked."""
    from spem.codes.collection import missing

    gone = set(missing(codes, paths))
    if gone and not prune:
        verb, them = ("is", "it") if len(gone) == 1 else ("are", "them")
        where = f"of {output} {verb} no longer in {', '.join(paths)}"
        complain(f"{counted(len(gone), 'shape')} {where}; --prune removes {them}")
    if not gone or not prune:
        return codes
    complain(f"removed {counted(len(gone), 'shape')} no longer in {', '.join(paths)}")
    return replace(codes.take([row for row in range(len(codes)) if row not in gone]), failures=codes.failures)


def load_model(path: Path) -> Model:
    """Read the model of a model file or of a codes file.

    Raises
    ------
    ReadError
        When it is neither.
    """
    from spem.codes.codes import Codes
    from spem.codes.model import Model

    try:
        return Model.load(path)
    except ReadError as error:
        try:
            return Codes.load(path).model
        except ReadError:
            raise error from None


def _settings(
    options: dict[str, Any], model: Model | None, source: Path | None, *, paper: bool
) -> Settings | None:
    """Return the settings to encode with; a model has its own, and options must not say otherwise."""
    from spem.codes.settings import Settings
    from spem.codes.traits import kinds_of

    if model is None:
        return Settings.paper(**options) if paper else Settings(**options)
    if paper:
        msg = f"--paper: {source} has settings of its own; leave it out, or write another file"
        raise ParameterError(msg)
    for key, value in options.items():
        fixed = getattr(model.settings, key)
        same = value == fixed if key != "features" else "+".join(kinds_of(value, model.ndim)) == fixed
        if not same:
            msg = f"{key}={value}: {source} has {key}={fixed}; leave it out, or write another file"
            raise ParameterError(msg)
    return None


def _tell(output: Path, codes: Codes, failures: tuple[Failure, ...], *, json: bool) -> None:
    """Tell what was written, and what failed in this run."""
    if not json:
        failed = f", {len(failures)} failed" if failures else ""
        model = f"features {codes.model.settings.features}, model {codes.model.digest}"
        typer.echo(f"wrote {output}: {counted(len(codes), 'shape')}{failed}, {model}")
        return
    facts = {"output": output, "n_shapes": len(codes), "n_failed": len(failures)}
    facts |= {"model": codes.model.digest, "settings": codes.model.settings.to_json()}
    print_json(facts | {"failures": [{"path": each.path, "reason": each.reason} for each in failures]})
