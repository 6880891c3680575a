"""The command ``mjspace recover``."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.terminal.options import LogFile


def recover(
    log: LogFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="A new MCAP file.")],
) -> None:
    """Save what is whole of a damaged log: its chunks, what explains them, a new summary."""
    from mjspace.log.recover import recover as to_log

    found = to_log(log, output)
    print(
        f"{output}: {found.chunks} chunks, {found.start:g} to {found.end:g} s, "
        f"{len(found.attachments)} attachments; lost: {found.lost or 'nothing'}"
    )
