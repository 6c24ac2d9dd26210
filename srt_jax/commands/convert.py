"""`srt-jax convert`: a file written in another format."""

import dataclasses
from typing import Annotated

import typer

from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import say, say_json, waiting
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, with_reading
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading, Source, read_source
from srt_jax.formats.task_files import all_prepared
from srt_jax.formats.writing import ENDINGS, with_flags_of_task, write_source


@with_reading
def convert(
    source: Annotated[
        str, typer.Argument(metavar="IN", help="Anything that solve reads.", show_default=False)
    ],
    target: Annotated[
        str, typer.Argument(metavar="OUT", help=", ".join(ENDINGS), show_default=False)
    ],
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    as_json: JsonOption = False,
) -> int:
    """Writes a map, place or task in another format, and says what that format has no room for."""
    read, wrote = Notes(), Notes()
    with options.print_notes(source, read, quiet=True), waiting("reading", quiet=as_json):
        found = read_source(source, dataclasses.replace(reading, chooses=True), read)
        tasks = all_prepared(source, found.tasks, destroyable, reading.block, read)
    if destroyable is not None or reading.block is not None:
        found = (
            found._replace(tasks=tasks, map=None)
            if reading.block is None
            else Source(tasks, frame=found.frame)
        )
        found = with_flags_of_task(found)
    with waiting("writing", quiet=as_json):
        write_source(target, found, wrote)
    if as_json:
        document = {
            "file": target,
            "tasks": len(found.tasks),
            "notes": read.records(source) + wrote.records(target),
        }
        say_json(document)
    else:
        options.print_lines(source, read)
        options.print_lines(target, wrote)
        say(
            f"Wrote {target}: {len(found.tasks)} task{'s' if len(found.tasks) != 1 else ''} from"
            f" {source}."
        )
    return 0
